# SPDX-License-Identifier: MIT
"""The result of a run, simulated or recorded: one row for each tick, hashes, maxima. Used by many modules of
host_tools: simulation, runs on the bus, reports, the Python API. No I/O.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..config.outputs import Outputs
from ..events import Events, no_events
from ..fixed_point import MM_PER_Q40
from ..names import AXES
from ..native.contour import Contour
from ..native.program import Counts, counts_by_axis
from .acted import ActedOutput, acted_outputs

SETTLING_S = 0.2
"""Settling time after the last tick, which is included in maxima, but not in hashes and traces
(docs/reference/protocol.md section 2).
"""

_Q32 = 2.0**-32


def settling_ticks(period_us: int) -> int:
    """Ticks of the settling time."""
    return round(SETTLING_S * 1e6) // period_us


@dataclass(frozen=True, eq=False)
class Motion:
    """A run. Row k: setpoint k, and the reports of the drives for SYNC k+2, when it is reached.

    `rows` has `native.ROW` records: the program's ticks, then the settling time; empty if the run did not keep them.
    Arrays of all A axes that follow the path, `names`, are (n, A). Hashes are over i32 little-endian x, y (…) of the
    program's ticks. The following error is that of one axis, setpoint less position; the contour error is the distance
    from the exact curve. Maxima include the settling time, the RMS of the contour error does not. `max_volts` None: the
    drives do not report their volts.

    `units`, `counts_per_unit` by axis. For a rotary axis mm in names stands for degrees, and um for thousandths of a
    degree. The greatest following error is that of the axes in mm. Axes after x, y, z have an orientation error: the
    difference between their position and that of the curve at its point nearest to the tool.
    """

    kernel: str
    period_us: int
    counts_per_unit: tuple[int, ...]
    ticks: int
    rows: NDArray[np.void]
    setpoints_sha256: str
    encoders_sha256: str
    max_contour_error_um: float
    rms_contour_error_um: float
    max_following_error_um: float
    max_volts: float | None
    names: tuple[str, ...] = AXES[:2]
    units: tuple[str, ...] = ("mm", "mm")
    orientation_error: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 0)))
    """(n, A - 3), actual less exact, in mm or degrees."""
    max_orientation_error: tuple[float, ...] = ()
    """Greatest orientation error of each axis after x, y, z, in mm or degrees."""
    max_following_error_mdeg: float | None = None
    """Greatest following error of the rotary axes; None: there is none."""
    event_ticks: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    """(E,) the tick in which each event of the program acted; -1: in none."""
    events: Events = field(default_factory=no_events)
    """Events of the program."""
    outputs: Outputs | None = None
    """The machine's outputs, which name what the events switch; None: it has none."""

    @property
    def turns_alone(self) -> bool:
        """Whether the path is drawn by rotary axes: its lengths are in degrees."""
        return "deg" in self.units[:2]

    @property
    def extra_names(self) -> tuple[str, ...]:
        """The axes after x, y, z."""
        return self.names[3:]

    @property
    def acted_outputs(self) -> list[ActedOutput]:
        """The switched outputs, in the order of their places."""
        return acted_outputs(self.outputs, self.events, self.event_ticks, self.period_us)

    @property
    def output_columns(self) -> dict[str, NDArray[Any]]:
        """The value of each output in each row, (n,), by its name: 0 or 1 of a digital one, that of an analogue one in
        its unit.
        """
        rows, channels = self.rows, self.outputs.channels if self.outputs is not None else ()
        return {
            one.name: rows["digital"] >> one.number & 1
            if one.digital
            else rows["analogue"][:, one.number] / one.scale
            for one in channels
        }

    @property
    def _counts(self) -> NDArray[np.int64]:
        return np.asarray(self.counts_per_unit, dtype=np.int64)

    def _by_axis(self, field: str) -> NDArray[Any]:
        return self.rows[field][:, : len(self.names)]

    def summary(self) -> dict[str, object]:
        """The keys that tools may rely on in `--json` output."""
        extra: dict[str, object] = {}
        if self.max_following_error_mdeg is not None:
            extra["max_following_error_mdeg"] = self.max_following_error_mdeg
        for name, unit, error in zip(
            self.extra_names, self.units[3:], self.max_orientation_error, strict=True
        ):
            extra[f"{name}_max_error_{unit}"] = error
        if self.outputs is not None:
            extra["outputs"] = [one.summary() for one in self.acted_outputs]
        return {
            "ticks": self.ticks,
            "setpoints_sha256": self.setpoints_sha256,
            "encoders_sha256": self.encoders_sha256,
            "max_contour_error_um": self.max_contour_error_um,
            "max_following_error_um": self.max_following_error_um,
            "max_volts": self.max_volts,
            "kernel": self.kernel,
            **extra,
        }

    @property
    def duration_s(self) -> float:
        """Time from the first setpoint of the program to its last, s."""
        return (self.ticks - 1) * self.period_us / 1e6

    @property
    def program_rows(self) -> NDArray[np.void]:
        """The rows of the program's ticks, without the settling time."""
        return self.rows[: self.ticks]

    @property
    def t_s(self) -> NDArray[np.float64]:
        """Time of each row since tick 0, s, (n,)."""
        return np.asarray(self.rows["tick"].astype(np.float64) * self.period_us / 1e6)

    @property
    def arc_length_mm(self) -> NDArray[np.float64]:
        """Commanded arc length, mm, (n,)."""
        return self.rows["arc_length_q40_mm"] * MM_PER_Q40

    @property
    def feed_mm_s(self) -> NDArray[np.float64]:
        """Commanded feed, mm/s, (n,)."""
        return self.rows["feed_q32_mm_s"] * _Q32

    @property
    def cmd_mm(self) -> NDArray[np.float64]:
        """Commanded point from the kernel, unrounded, mm, (n, A)."""
        return self._by_axis("cmd_q40_mm") * MM_PER_Q40

    @property
    def set_mm(self) -> NDArray[np.float64]:
        """Setpoint as it goes over the bus, mm, (n, A)."""
        return self.set_counts / self._counts

    @property
    def set_counts(self) -> NDArray[np.int32]:
        """Setpoint in counts, (n, A)."""
        return self._by_axis("set_counts")

    @property
    def act_mm(self) -> NDArray[np.float64]:
        """Encoder position, mm, (n, A)."""
        return np.asarray(self._by_axis("act_counts") / self._counts)

    @property
    def following_error_um(self) -> NDArray[np.float64]:
        """Setpoint less position, by axis, um, or thousandths of a degree, (n, A)."""
        difference = self.set_counts.astype(np.int64) - self._by_axis("act_counts")
        return np.asarray(difference * (1000.0 / self._counts))

    @property
    def contour_error_um(self) -> NDArray[np.float64]:
        """Distance of the encoder position from the exact curve, um, (n,)."""
        return np.asarray(self.rows["contour_error_um"])

    @property
    def volts(self) -> NDArray[np.float64]:
        """Drive voltage by axis, V, (n, A); NaN: the drives do not report it."""
        volts = self._by_axis("volts_mv") / 1000.0
        return volts if self.max_volts is not None else np.full_like(volts, np.nan)


class MotionTotals:
    """Hashes and maxima of a run, which is added in parts, so that a run of any length needs bounded memory."""

    def __init__(
        self,
        ticks: int,
        counts_per_mm: Counts,
        names: tuple[str, ...] = AXES[:2],
        units: Sequence[str] | None = None,
        contour: Contour | None = None,
        events: Events | None = None,
    ) -> None:
        """For a program of `ticks` ticks and these axes; rows added beyond the ticks count as settling.

        units    of the axes (default mm)
        contour  of a program with axes after x, y, z; None: it has no such axes
        events   of the program; None: it has no events
        """
        self._left = ticks
        self._names = names
        self._units = ("mm",) * len(names) if units is None else tuple(units)
        self._counts = counts_by_axis(counts_per_mm, len(names))
        self._contour = contour
        self._orientation: list[NDArray[np.float64]] = []
        self._max_orientation = np.zeros(max(len(names) - 3, 0))
        self._setpoints = hashlib.sha256()
        self._encoders = hashlib.sha256()
        self._contour_um = 0.0
        self._contour_um2 = 0.0
        self._rows = 0
        self._following_counts = np.zeros(len(names), dtype=np.int64)
        self._volts_mv = 0
        self._events = no_events() if events is None else events
        self._event_ticks = np.full(self._events.shape, -1, dtype=np.int64)

    def add(self, rows: NDArray[np.void]) -> None:
        """Adds the next rows, of `native.ROW`."""
        counted = rows[: self._left]
        self._left -= counted.size
        path = np.s_[:, : len(self._names)]
        self._setpoints.update(counted["set_counts"][path].tobytes())
        self._encoders.update(counted["act_counts"][path].tobytes())
        if rows.size == 0:
            return
        self._note_events(rows)
        lags = np.abs(rows["set_counts"][path].astype(np.int64) - rows["act_counts"][path])
        self._following_counts = np.maximum(self._following_counts, lags.max(axis=0))
        if self._contour is not None:
            error = self._contour.extra_errors(
                rows["arc_length_q40_mm"], rows["act_counts"][path], self._counts
            )
            self._max_orientation = np.maximum(self._max_orientation, np.abs(error).max(axis=0))
            self._orientation.append(error)
        self._contour_um = max(self._contour_um, float(rows["contour_error_um"].max()))
        contour_um = counted["contour_error_um"]
        self._contour_um2 += math.fsum(
            (contour_um * contour_um).tolist()
        )  # the same on every processor
        self._rows += counted.size
        self._volts_mv = max(
            self._volts_mv, int(np.abs(rows["volts_mv"][path].astype(np.int32)).max())
        )

    def _note_events(self, rows: NDArray[np.void]) -> None:
        """An event acts with the first setpoint at or past its place."""
        arc_q40 = rows["arc_length_q40_mm"]
        waiting = self._event_ticks < 0
        if not waiting.any():
            return
        highest = np.maximum.accumulate(arc_q40)
        due = waiting & (self._events["place"] <= highest[-1])
        found = np.searchsorted(highest, self._events["place"][due], side="left")
        self._event_ticks[due] = rows["tick"][found]

    def _greatest_following(self, unit: str) -> float | None:
        """Greatest following error of the axes with this unit, in thousandths of it; None: there is no such axis."""
        every = zip(self._following_counts.tolist(), self._counts, self._units, strict=True)
        return max((most * (1000.0 / own) for most, own, its in every if its == unit), default=None)

    def motion(self, *, kernel: str, period_us: int, ticks: int, rows: NDArray[np.void]) -> Motion:
        """The result, with the `rows` that were kept."""
        kept = self._orientation if rows.size else []
        error = np.concatenate(kept) if kept else np.zeros((rows.size, self._max_orientation.size))
        return Motion(
            kernel=kernel,
            period_us=period_us,
            counts_per_unit=self._counts,
            ticks=ticks,
            rows=rows,
            setpoints_sha256=self._setpoints.hexdigest(),
            encoders_sha256=self._encoders.hexdigest(),
            max_contour_error_um=self._contour_um,
            rms_contour_error_um=math.sqrt(self._contour_um2 / max(self._rows, 1)),
            max_following_error_um=self._greatest_following("mm") or 0.0,
            max_volts=self._volts_mv / 1000.0,
            names=self._names,
            units=self._units,
            orientation_error=error,
            max_orientation_error=tuple(self._max_orientation.tolist()),
            max_following_error_mdeg=self._greatest_following("deg"),
            event_ticks=self._event_ticks,
            events=self._events,
        )
