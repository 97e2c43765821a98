# SPDX-License-Identifier: MIT
"""What the PDOs of a drive hold, from its EDS: communication (0x1400, 0x1800) and mapping (0x1600, 0x1A00) objects."""

from __future__ import annotations

import configparser
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import canopen
from canopen.objectdictionary import datatypes

from ..data import DRIVE_EDS
from ..errors import InputError

_INVALID = 1 << 31
_PDOS_PER_DIRECTION = 4


@dataclass(frozen=True)
class Entry:
    """One mapped object."""

    index: int
    sub: int
    bits: int
    name: str
    signed: bool


@dataclass(frozen=True)
class Pdo:
    """One PDO that is valid by default. `received` is seen from the drive: RPDO."""

    received: bool
    number: int
    cob_id: int
    entries: tuple[Entry, ...]

    @property
    def name(self) -> str:
        """RPDO1, TPDO2, …"""
        return f"{'R' if self.received else 'T'}PDO{self.number}"

    @property
    def size(self) -> int:
        """Data bytes."""
        return (sum(entry.bits for entry in self.entries) + 7) // 8


@cache
def drive_pdos(node: int, eds: Path = DRIVE_EDS) -> tuple[Pdo, ...]:
    """The PDOs of drive `node` as its EDS has them by default. Raises InputError."""
    try:
        dictionary = canopen.import_od(str(eds), node_id=node)
        found = [
            _pdo(dictionary, received, number)
            for received in (True, False)
            for number in range(1, _PDOS_PER_DIRECTION + 1)
        ]
    except (OSError, ValueError, KeyError, TypeError, configparser.Error) as error:
        text = " ".join(str(error).split())
        raise InputError(f"{eds}: not an EDS with PDOs that can be read: {text}") from None
    return tuple(pdo for pdo in found if pdo is not None and pdo.entries)


def _pdo(dictionary: canopen.ObjectDictionary, received: bool, number: int) -> Pdo | None:
    communication = (0x1400 if received else 0x1800) + number - 1
    mapping = (0x1600 if received else 0x1A00) + number - 1
    if communication not in dictionary or mapping not in dictionary:
        return None
    cob_id = _default(dictionary, communication, 1)
    if cob_id & _INVALID:
        return None
    count = _default(dictionary, mapping, 0)
    values = [_default(dictionary, mapping, sub) for sub in range(1, count + 1)]
    entries = tuple(_entry(dictionary, value) for value in values if value)
    return Pdo(received, number, cob_id & 0x7FF, entries)


def _default(dictionary: canopen.ObjectDictionary, index: int, sub: int) -> int:
    variable = dictionary.get_variable(index, sub)
    return int(variable.default or 0) if variable is not None else 0


def _entry(dictionary: canopen.ObjectDictionary, value: int) -> Entry:
    index, sub, bits = value >> 16, value >> 8 & 0xFF, value & 0xFF
    found = dictionary[index]
    variable = found if isinstance(found, canopen.objectdictionary.ODVariable) else found[sub]
    signed = variable.data_type in datatypes.SIGNED_TYPES
    return Entry(index, sub, bits, str(variable.name), signed)
