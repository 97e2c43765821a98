# SPDX-License-Identifier: MIT
"""The text of a machine file for the drives that were found, with comments on their reports and on values that remain
to be set. Used by cli/commission_commands. No I/O.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

from ..config.axis_table import MAX_AXES
from .drive_properties import CSP, HOMING, DriveProperties

NAMES = ("x", "y", "z", "a", "b", "c")
COUNTS_PER_MM = 1_000_000
_NO_LIMIT = 2**31 - 1
_FEED, _ACCELERATION, _JERK = 20, 200, 5000
"""Low initial limits."""


def machine_text(
    drives: Sequence[DriveProperties], bitrate: int, where: str, others: Collection[int] = ()
) -> str:
    """The text of a machine file for 1 … 6 drives, in the order of their node numbers; `where` names the bus.

    others  numbers of the nodes that are no drives: the controller gets none of them
    """
    nodes = {drive.node for drive in drives}.union(others)
    controller = next(node for node in range(1, 128) if node not in nodes)
    parts = [
        f"# Drives found on {where} by `hodograph scan`.\n"
        "# Lines with SET need your figures: limits of the axes, and counts_per_mm by the screw.\n"
        "# `hodograph check` compares this file with the drives; docs/guides/machine.md.\n",
        f"[bus]\nbitrate = {bitrate}\nperiod_us = {2000 if len(drives) > 2 else 1000}"
        "                # 1000, 2000, 4000 or 8000\n",
        "[controller]\n"
        f"node = {controller}                        # free on this bus\n"
        f"feed_mm_s = {_FEED}                  # SET; low to begin with\n"
        f"acceleration_mm_s2 = {_ACCELERATION}        # SET\n"
        f"jerk_mm_s3 = {_JERK}               # SET\n",
        *(_axis(drive, name) for drive, name in zip(drives[:MAX_AXES], NAMES, strict=False)),
    ]
    return "\n".join(parts)


def _axis(drive: DriveProperties, name: str) -> str:
    return "\n".join(
        [*_reported(drive), "[[axis]]", *_keys(drive, name), "", *_identity(drive), ""]
    )


def _reported(drive: DriveProperties) -> Iterator[str]:
    yield f"# Node {drive.node}: {drive.described or 'no name'}"
    if CSP not in drive.modes:
        yield "# has no mode cyclic synchronous position: Hodograph cannot use this drive"
    yield f"# modes {', '.join(map(str, drive.modes)) or 'not reported'} of CiA 402"
    for text, value in (
        ("encoder increments in one turn of the motor (0x608F)", drive.encoder_increments),
        ("motor turns for one shaft turn (0x6091)", drive.gear_ratio),
        ("counts in one turn of the shaft (0x6092)", drive.feed_counts),
        ("greatest profile velocity (0x607F), counts/s", drive.velocity_counts_s),
        ("greatest acceleration (0x60C5), counts/s^2", drive.acceleration_counts_s2),
        ("quick stop deceleration (0x6085), counts/s^2", drive.quick_stop_counts_s2),
        ("following error window (0x6065), counts", drive.window_counts),
    ):
        if value is not None:
            yield f"# {value:.15g} {text}"


def _keys(drive: DriveProperties, name: str) -> Iterator[str]:
    yield f'name = "{name}"                      # SET if the axis has another name'
    yield f"node = {drive.node}"
    yield f"counts_per_mm = {COUNTS_PER_MM}         # SET, the same for all axes{_screw(drive)}"
    low, high = _travel(drive)
    origin = "the drive's software limits" if _has_limits(drive) else "the drive reports no limits"
    travel = f"travel_mm = [{low:.10g}, {high:.10g}]"
    yield f"{travel:31} # SET; {origin}"
    yield f"velocity_mm_s = {_FEED}              # SET; low to begin with"
    yield f"acceleration_mm_s2 = {_ACCELERATION}        # SET"
    yield f"jerk_mm_s3 = {_JERK}               # SET"
    if HOMING in drive.modes:
        yield "# homing = { method = 37 }        # SET: how the drive finds zero (docs/reference/files.md)"


def _screw(drive: DriveProperties) -> str:
    if drive.feed_counts is None:
        return ": counts in one turn of the shaft, divided by the lead of the screw in mm"
    return f": {drive.feed_counts:.15g} divided by the lead of the screw in mm"


def _has_limits(drive: DriveProperties) -> bool:
    low, high = drive.limit_min_counts, drive.limit_max_counts
    return low is not None and high is not None and -_NO_LIMIT < low < high < _NO_LIMIT


def _travel(drive: DriveProperties) -> tuple[float, float]:
    if not _has_limits(drive):
        return -10.0, 10.0
    assert drive.limit_min_counts is not None
    assert drive.limit_max_counts is not None
    return drive.limit_min_counts / COUNTS_PER_MM, drive.limit_max_counts / COUNTS_PER_MM


def _identity(drive: DriveProperties) -> Iterator[str]:
    given = {"vendor": drive.vendor, "product": drive.product, "revision": drive.revision}
    keys = {key: value for key, value in given.items() if value}
    if keys:
        yield "[axis.identity]                 # another drive at this node is refused"
        for key, value in keys.items():
            yield f"{key} = 0x{value:08X}"
