# SPDX-License-Identifier: MIT
"""The object values that configure a controller for a machine file (docs/reference/protocol.md section 3). Used by
bus/goto, sdo/controller, sdo/status and cli/record_command.

`sdo/controller` writes them. `configured_limits` and its like read the present values by SDO; no other I/O.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from ...names import KERNELS
from . import objects
from .objects import CONFIGURATION, Object

if TYPE_CHECKING:
    from canopen import ObjectDictionary

    from ...config import Axis, Machine
    from ...config.outputs import Outputs
    from .node import Node

WINDOW_OFF = 2**32 - 1


def configuration(machine: Machine, kernel: str) -> list[tuple[Object, int]]:
    """Objects of the controller with the values that they need for this machine."""
    supervision = machine.supervision
    wanted: list[tuple[Object, int]] = [
        ((objects.PERIOD, None), machine.period_us),
        ((CONFIGURATION, 1), len(machine.axes)),
        ((CONFIGURATION, 2), round(machine.feed_mm_s * 1000)),
        ((CONFIGURATION, 3), round(machine.acceleration_mm_s2 * 1000)),
        ((CONFIGURATION, 4), round(machine.jerk_mm_s3)),
        ((CONFIGURATION, 5), KERNELS.index(kernel)),
        ((CONFIGURATION, 6), machine.start_tolerance_counts),
        ((CONFIGURATION, 7), machine.counts_per_mm),
        ((CONFIGURATION, 8), supervision.answer_wait_ms),
        ((CONFIGURATION, 9), supervision.missed_max),
        ((CONFIGURATION, 10), supervision.setpoint_timeout_ms),
        ((CONFIGURATION, 12), machine.stop_time_ms),
        ((CONFIGURATION, 11), feedforward_bits(machine)),
        *(((objects.OUTPUT_MODULE, sub), value) for sub, value in _outputs(machine.outputs)),
    ]
    for sub, axis in enumerate(machine.axes, start=1):
        wanted += [((index, sub), value) for index, value in _axis(axis)]
    return wanted


def configuration_crc32(wanted: Sequence[tuple[Object, int]], dictionary: ObjectDictionary) -> int:
    """The CRC-32 that a controller with this configuration has in 0x2050 sub 1 (docs/reference/protocol.md
    section 3.4).

    `dictionary`: of the controller; gives the bytes of each value.
    """
    crc = 0
    for (index, sub), value in sorted(wanted, key=lambda entry: (entry[0][0], entry[0][1] or 0)):
        variable = dictionary.get_variable(index, sub or 0)
        assert variable is not None, f"0x{index:04X} sub {sub}"
        crc = zlib.crc32(struct.pack("<HB", index, sub or 0) + variable.encode_raw(value), crc)
    return crc


def configured_limits(controller: Node) -> tuple[float, float, int, int]:
    """Feed in mm/s, acceleration in mm/s^2, period in us, counts per mm, as they are now. Raises BusError."""
    feed_um_s, acceleration_um_s2, counts = (controller.read(CONFIGURATION, n) for n in (2, 3, 7))
    return feed_um_s / 1000, acceleration_um_s2 / 1000, controller.read(objects.PERIOD), counts


def configured_axis_limits(controller: Node, axes: int) -> tuple[tuple[float, float, float], ...]:
    """Velocity in mm/s, acceleration in mm/s^2 and jerk in mm/s^3 of each axis, as they are now. Raises BusError."""

    def of(axis: int) -> tuple[float, float, float]:
        velocity_um_s = controller.read(objects.AXIS_VELOCITY_LIMIT, axis)
        acceleration_um_s2 = controller.read(objects.AXIS_ACCELERATION_LIMIT, axis)
        jerk_mm_s3 = controller.read(objects.AXIS_JERK_LIMIT, axis)
        return velocity_um_s / 1000, acceleration_um_s2 / 1000, float(jerk_mm_s3)

    return tuple(of(axis) for axis in range(1, axes + 1))


def configured_nodes(controller: Node) -> tuple[int, ...]:
    """The nodes of the controller's axes. Raises BusError."""
    count = controller.read(CONFIGURATION, 1)
    return tuple(controller.read(objects.AXIS_NODE, sub) for sub in range(1, count + 1))


def feedforward_bits(machine: Machine) -> int:
    """The offsets that setpoints have in addition to the position."""
    torque, velocity = machine.torque_feedforward, machine.velocity_feedforward
    return objects.FEEDFORWARD_TORQUE * torque + objects.FEEDFORWARD_VELOCITY * velocity


def configured_counts(controller: Node, axes: int) -> tuple[int, ...]:
    """Counts of a mm, or of a degree of a rotary axis, for each axis as they are now. Raises BusError."""
    common = controller.read(CONFIGURATION, 7)
    return tuple(
        controller.read(objects.COUNTS_PER_UNIT, axis) or common for axis in range(1, axes + 1)
    )


def configured_travel(controller: Node, axis: int) -> tuple[int, int]:
    """Least and greatest position of an axis, from 1, in counts as they are now. Raises BusError."""
    least = controller.read(objects.TRAVEL_MINIMUM, axis)
    return least, controller.read(objects.TRAVEL_MAXIMUM, axis)


def configured_tolerances(controller: Node, counts: Sequence[int]) -> tuple[int, ...]:
    """Start tolerance of each axis in counts, as the controller computes it (docs/reference/protocol.md section 3,
    0x2004 sub 6). Raises BusError.

    counts  of a mm or degree of each axis (`configured_counts`)
    """
    tolerance, common = (controller.read(CONFIGURATION, n) for n in (6, 7))
    return tuple(min(tolerance * own // common, 2**32 - 1) for own in counts)


def _outputs(outputs: Outputs | None) -> Iterator[tuple[int, int]]:
    """Sub-indices of the I/O module's object; without a module, what a controller has by default."""
    values = (0, 0, 0, 0, 1, 0, 0)
    if outputs is not None:
        values = (
            outputs.node,
            outputs.digital_count,
            outputs.analogue_count,
            outputs.behaviour,
            outputs.delay_ticks,
            outputs.vendor,
            outputs.product,
        )
    yield from enumerate(values, start=1)


def _axis(axis: Axis) -> Iterator[tuple[int, int]]:
    def counts(units: float) -> int:
        return round(units * axis.counts_per_unit)

    yield objects.COUNTS_PER_UNIT, axis.counts_per_unit if axis.turns else 0

    yield objects.AXIS_NODE, axis.node
    yield objects.TRAVEL_MINIMUM, counts(axis.travel_min_mm)
    yield objects.TRAVEL_MAXIMUM, counts(axis.travel_max_mm)
    yield objects.AXIS_VELOCITY_LIMIT, round(axis.velocity_mm_s * 1000)
    yield objects.AXIS_ACCELERATION_LIMIT, round(axis.acceleration_mm_s2 * 1000)
    yield objects.AXIS_JERK_LIMIT, round(axis.jerk_mm_s3)
    homing, forward, scaling = axis.homing, axis.feedforward, axis.scaling
    yield objects.HOMING_METHOD, homing.method
    yield objects.HOMING_SEQUENCE, homing.sequence
    yield objects.HOME_OFFSET, counts(homing.offset_mm)
    yield objects.HOMING_SPEED, counts(homing.speed_mm_s)
    yield objects.HOMING_SLOW, counts(homing.slow_mm_s)
    yield objects.HOMING_ACCELERATION, counts(homing.acceleration_mm_s2)
    yield objects.VELOCITY_FEEDFORWARD, forward.velocity_permille
    yield objects.TORQUE_PER_ACCELERATION, forward.torque_per_acceleration_q16
    yield objects.TORQUE_PER_VELOCITY, forward.torque_per_velocity_q16
    window = axis.following_window_mm
    yield objects.FOLLOWING_WINDOW, WINDOW_OFF if window is None else counts(window)
    yield objects.FOLLOWING_TIMEOUT, axis.following_timeout_ms
    yield objects.QUICK_STOP_DECELERATION, counts(axis.quick_stop_mm_s2)
    yield objects.ENCODER_INCREMENTS, scaling.encoder_increments_per_rev
    yield objects.FEED_CONSTANT, scaling.feed_counts_per_rev
    yield objects.GEAR_MOTOR, scaling.gear_motor_revolutions
    yield objects.GEAR_SHAFT, scaling.gear_shaft_revolutions
    yield objects.EXPECTED_VENDOR, axis.identity.vendor
    yield objects.EXPECTED_PRODUCT, axis.identity.product
    yield objects.EXPECTED_REVISION, axis.identity.revision
