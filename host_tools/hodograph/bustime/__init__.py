# SPDX-License-Identifier: MIT
"""Time on the bus: length of frames, worst-case response, load, whether a machine's tick fits (docs/bus-time.md)."""

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
