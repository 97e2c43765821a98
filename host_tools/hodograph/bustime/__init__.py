# SPDX-License-Identifier: MIT
"""Time on the bus: length of frames, worst-case response, load, whether a machine's tick fits
(docs/reference/bus-time.md). Used by api/bus, bus/, cli/ and dbc. Reads the EDS of drives; no other I/O.

Modules are loaded when their names are first used: the length of a frame needs numpy only, the rest the machine file.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .fit import bus_time, machine_bus_time, max_drives, require_fit
    from .frame_bits import exact_bits, generic_worst_bits, plain_bits, worst_bits
    from .model import BusTime
    from .pdos import Entry, Pdo, PdoChoice, axis_choice, drive_pdos
    from .recording import KindLoad, RecordedLoad, recorded_load
    from .traffic import Message, machine_drives, messages

__all__ = [
    "BusTime",
    "Entry",
    "KindLoad",
    "Message",
    "Pdo",
    "PdoChoice",
    "RecordedLoad",
    "axis_choice",
    "bus_time",
    "drive_pdos",
    "exact_bits",
    "generic_worst_bits",
    "machine_bus_time",
    "machine_drives",
    "max_drives",
    "messages",
    "plain_bits",
    "recorded_load",
    "require_fit",
    "worst_bits",
]

_HOMES = {
    **dict.fromkeys(
        (
            "bus_time",
            "machine_bus_time",
            "max_drives",
            "require_fit",
        ),
        "fit",
    ),
    **dict.fromkeys(
        (
            "exact_bits",
            "generic_worst_bits",
            "plain_bits",
            "worst_bits",
        ),
        "frame_bits",
    ),
    **dict.fromkeys(("BusTime",), "model"),
    **dict.fromkeys(
        (
            "Entry",
            "Pdo",
            "PdoChoice",
            "axis_choice",
            "drive_pdos",
        ),
        "pdos",
    ),
    **dict.fromkeys(
        (
            "KindLoad",
            "RecordedLoad",
            "recorded_load",
        ),
        "recording",
    ),
    **dict.fromkeys(
        (
            "Message",
            "machine_drives",
            "messages",
        ),
        "traffic",
    ),
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_HOMES[name]}", __name__), name)
