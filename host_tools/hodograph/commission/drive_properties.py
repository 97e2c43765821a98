# SPDX-License-Identifier: MIT
"""Drive properties, as a node reports them: identity, modes, scaling, limits. Used by cli/commission_commands,
commission/check and commission/machine_text. Reads objects of the drive by SDO.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from fractions import Fraction
from typing import Any

from .nodes import NodeReader

PROFILE = 402
"""Low half of 0x1000 of a drive by CiA 402."""
MODES = {
    1: "profile position",
    3: "profile velocity",
    4: "torque profile",
    6: "homing",
    7: "interpolated position",
    8: "cyclic synchronous position",
    9: "cyclic synchronous velocity",
    10: "cyclic synchronous torque",
}
CSP, HOMING = 8, 6


@dataclass(frozen=True)
class DriveProperties:
    """A node. None: it does not have the object.

    modes               numbers of CiA 402, from 0x6502
    encoder_increments  for one turn of the motor (0x608F)
    gear_ratio          turns of the motor for one of the shaft (0x6091)
    feed_counts         counts for one turn of the shaft (0x6092)
    limit_min_counts, limit_max_counts     software limits (0x607D)
    velocity_counts_s   greatest profile velocity (0x607F)
    acceleration_counts_s2                 greatest acceleration (0x60C5)
    window_counts, window_ms               following error window (0x6065, 0x6066)
    quick_stop_counts_s2                   deceleration of a quick stop (0x6085)
    error_code          0x603F
    """

    node: int
    device_type: int
    name: str | None = None
    hardware: str | None = None
    software: str | None = None
    vendor: int | None = None
    product: int | None = None
    revision: int | None = None
    serial: int | None = None
    modes: tuple[int, ...] = ()
    encoder_increments: float | None = None
    gear_ratio: float | None = None
    feed_counts: float | None = None
    position_counts: int | None = None
    limit_min_counts: int | None = None
    limit_max_counts: int | None = None
    velocity_counts_s: int | None = None
    acceleration_counts_s2: int | None = None
    window_counts: int | None = None
    window_ms: int | None = None
    quick_stop_counts_s2: int | None = None
    statusword: int | None = None
    error_code: int | None = None

    @property
    def is_drive(self) -> bool:
        """Whether its device type is that of drives."""
        return self.device_type & 0xFFFF == PROFILE

    @property
    def described(self) -> str:
        """Name of the drive and the versions of its hardware and software; empty if it reports none of them."""
        texts = (
            self.name,
            f"hardware {self.hardware}" if self.hardware else None,
            f"software {self.software}" if self.software else None,
        )
        return ", ".join(text for text in texts if text)

    def json(self) -> dict[str, Any]:
        """By name, ready for JSON."""
        return asdict(self) | {"modes": list(self.modes), "is_drive": self.is_drive}


def read_properties(reader: NodeReader) -> DriveProperties:
    """Reads the properties of a node. Raises BusError: it does not answer, or has no device type."""
    device_type = reader.number(0x1000) or 0
    properties: dict[str, Any] = {
        "name": reader.text(0x1008),
        "hardware": reader.text(0x1009),
        "software": reader.text(0x100A),
        "vendor": reader.number(0x1018, 1),
        "product": reader.number(0x1018, 2),
        "revision": reader.number(0x1018, 3),
        "serial": reader.number(0x1018, 4),
    }
    if device_type & 0xFFFF == PROFILE:
        properties |= _drive(reader)
    return DriveProperties(reader.node, device_type, **properties)


def _drive(reader: NodeReader) -> dict[str, Any]:
    return {
        "modes": supported_modes(reader.number(0x6502) or 0),
        "encoder_increments": _ratio(reader, 0x608F),
        "gear_ratio": _ratio(reader, 0x6091),
        "feed_counts": _ratio(reader, 0x6092),
        "position_counts": reader.number(0x6064, signed=True),
        "limit_min_counts": reader.number(0x607D, 1, signed=True),
        "limit_max_counts": reader.number(0x607D, 2, signed=True),
        "velocity_counts_s": reader.number(0x607F),
        "acceleration_counts_s2": reader.number(0x60C5),
        "window_counts": reader.number(0x6065),
        "window_ms": reader.number(0x6066),
        "quick_stop_counts_s2": reader.number(0x6085),
        "statusword": reader.number(0x6041),
        "error_code": reader.number(0x603F),
    }


def supported_modes(bits: int) -> tuple[int, ...]:
    """Numbers of the modes in 0x6502: bit n - 1 stands for mode n."""
    return tuple(n for n in range(1, 17) if bits >> (n - 1) & 1)


def _ratio(reader: NodeReader, index: int) -> float | None:
    """Sub 1 over sub 2; None: there is none, or it is no ratio."""
    first, second = reader.number(index, 1), reader.number(index, 2)
    if not first or not second:
        return None
    return float(Fraction(first, second))
