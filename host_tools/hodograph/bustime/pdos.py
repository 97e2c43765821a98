# SPDX-License-Identifier: MIT
"""Which objects the PDOs of a drive carry (docs/reference/protocol.md section 2), for the bus load and for DBC files.
Names and types are from the EDS of the drive. Used by bustime/fit, bustime/traffic and hodograph/dbc. Reads the EDS.
"""

from __future__ import annotations

import configparser
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import canopen
from canopen.objectdictionary import datatypes

from ..config import Axis, Machine
from ..data import DRIVE_EDS, object_dictionary
from ..errors import InputError

CONTROLWORD, TARGET, TORQUE_OFFSET, VELOCITY_OFFSET = 0x60400010, 0x607A0020, 0x60B20010, 0x60B10020
STATUSWORD, ACTUAL, VOLTS, INPUTS = 0x60410010, 0x60640020, 0x21000010, 0x60FD0020
"""Mapping parameters: index, sub-index, bits."""


@dataclass(frozen=True)
class PdoChoice:
    """Which optional objects the PDOs of a drive carry, in addition to setpoint (RPDO1) and position (TPDO1)."""

    torque: bool = False
    """A torque offset in RPDO1."""
    velocity: bool = False
    """A velocity offset, in RPDO2."""
    volts: bool = True
    """TPDO2, of simulated drives."""
    inputs: bool = True
    """TPDO3, of drives that have digital inputs."""


def axis_choice(machine: Machine, axis: Axis) -> PdoChoice:
    """The choice of a machine file; an axis without a model is no simulated drive."""
    return PdoChoice(
        machine.torque_feedforward, machine.velocity_feedforward, axis.drive is not None
    )


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
    """One PDO. `received` is seen from the drive: RPDO."""

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
def drive_pdos(
    node: int, choice: PdoChoice | None = None, eds: Path = DRIVE_EDS
) -> tuple[Pdo, ...]:
    """The PDOs of drive `node`. Raises InputError: no EDS, or objects that setpoint or position need are not in it.

    TPDO2 and TPDO3 are left out where the EDS has no such object.
    """
    try:
        dictionary = object_dictionary(eds, node)
        return tuple(_pdos(dictionary, node, choice or PdoChoice()))
    except (OSError, ValueError, KeyError, TypeError, configparser.Error) as error:
        text = " ".join(str(error).split())
        raise InputError(f"{eds}: not an EDS with the objects of a drive: {text}") from None


def _pdos(dictionary: canopen.ObjectDictionary, node: int, choice: PdoChoice) -> Iterator[Pdo]:
    setpoint = (CONTROLWORD, TARGET, *((TORQUE_OFFSET,) if choice.torque else ()))
    yield Pdo(True, 1, 0x200 + node, _entries(dictionary, setpoint))
    if choice.velocity:
        yield Pdo(True, 2, 0x300 + node, _entries(dictionary, (VELOCITY_OFFSET,)))
    yield Pdo(False, 1, 0x180 + node, _entries(dictionary, (STATUSWORD, ACTUAL)))
    if choice.volts and VOLTS >> 16 in dictionary:
        yield Pdo(False, 2, 0x280 + node, _entries(dictionary, (VOLTS,)))
    if choice.inputs and INPUTS >> 16 in dictionary:
        yield Pdo(False, 3, 0x380 + node, _entries(dictionary, (INPUTS,)))


def _entries(dictionary: canopen.ObjectDictionary, mapped: tuple[int, ...]) -> tuple[Entry, ...]:
    return tuple(_entry(dictionary, value) for value in mapped)


def _entry(dictionary: canopen.ObjectDictionary, value: int) -> Entry:
    index, sub, bits = value >> 16, value >> 8 & 0xFF, value & 0xFF
    if index not in dictionary:
        raise KeyError(f"object 0x{index:04X} is missing")
    found = dictionary[index]
    variable = found if isinstance(found, canopen.objectdictionary.ODVariable) else found[sub]
    signed = variable.data_type in datatypes.SIGNED_TYPES
    return Entry(index, sub, bits, str(variable.name), signed)
