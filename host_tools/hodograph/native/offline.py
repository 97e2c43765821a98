# SPDX-License-Identifier: MIT
"""The offline simulation: controller and axes in one process, without a bus (sim/offline/offline.h). Used by simulate/,
campaign/ and tune/cases. No I/O.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..errors import HodographError, InputError
from ..events import ANALOGUES
from ..fixed_point import MM_PER_Q40
from .drive import drive_config
from .library import library, text
from .program import AXES, Counts, NativeProgram, counts_by_axis

if TYPE_CHECKING:
    from ..config.axis_table import Feedforward
    from ..config.drive_file import Drive

ROW = np.dtype(
    [
        ("arc_length_q40_mm", "<i8"),
        ("feed_q32_mm_s", "<i8"),
        ("cmd_q40_mm", "<i8", (AXES,)),
        ("contour_error_um", "<f8"),
        ("set_counts", "<i4", (AXES,)),
        ("act_counts", "<i4", (AXES,)),
        ("volts_mv", "<i2", (AXES,)),
        ("tick", "<u4"),
        ("digital", "<u2"),
        ("analogue", "<i2", (ANALOGUES,)),
    ]
)
"""One tick, struct offline_row of sim/offline/offline.h: setpoint k, and the drives' report for SYNC k+2. Axes beyond
those of the program are 0.
"""


FAULT_KINDS = ("encoder-freeze", "encoder-jump", "saturate", "load", "setpoint-lost")
"""Kinds of an `OfflineFault`, in the order of enum offline_fault_kind."""

ORDER_KINDS = ("hold", "resume", "override", "stop", "fault-stop")
"""Kinds of an `OfflineOrder`, in the order of enum offline_order_kind."""

FOR_EVER = 2**32 - 1
"""`ticks` of a fault that does not end."""


@dataclass(frozen=True)
class OfflineFault:
    """A fault of an axis (from 0) for `ticks` ticks from tick `at` on (sim/offline/offline_fault.h).

    `value`: bus counts of a jump, volts of a voltage limit or load. Ticks count as in
    docs/reference/protocol.md section 4.
    """

    kind: str
    axis: int
    at: int
    ticks: int
    value: float = 0.0


@dataclass(frozen=True)
class OfflineOrder:
    """A command that takes effect with setpoint `tick`; `percent` of an override."""

    kind: str
    tick: int
    percent: int = 0


@dataclass(frozen=True)
class RigStop:
    """The last hold, stop or fault stop: struct offline_stop.

    tick       the first setpoint after the command
    rest_tick  the first one at rest; None: there is none yet
    bound_s    of the stop table, at the place of the command
    from_mm, rest_mm  arc lengths of the last setpoint before it and at rest
    """

    tick: int
    rest_tick: int | None
    bound_s: float
    from_mm: float
    rest_mm: float


class OfflineSimulation:
    """Interpolator, drives of a program's axes, and contour error. The drives begin at the program's start, in
    standstill lock.
    """

    def __init__(
        self,
        program: NativeProgram,
        kernel: str,
        drives: Sequence[Drive],
        counts_per_mm: Counts,
        feedforward: Sequence[Feedforward] | None = None,
        faults: Sequence[OfflineFault] = (),
        orders: Sequence[OfflineOrder] = (),
    ) -> None:
        """Set up, with the controller's feedforward (None: none), faults, and orders by ascending tick.

        counts_per_mm  of all axes, or of each (of a degree for a rotary axis)

        Raises InputError: the kernel is unknown, figures are out of range, or the program is not accepted.
        """
        ffi, lib = library()
        precomputed = program.precomputed(kernel)
        self._program = program  # keeps the image alive
        self._segments = ffi.new("struct contour_segment[]", program.segment_count)
        self._rig = ffi.new("struct offline *")
        counts = counts_by_axis(counts_per_mm, len(drives))
        configs = [
            drive_config(drive, own, program.period_us)
            for drive, own in zip(drives, counts, strict=True)
        ]
        error = lib.offline_begin(
            self._rig,
            precomputed,
            ffi.new("struct drive_config[]", configs),
            self._segments,
        )
        if error != 0:
            raise InputError(_begin_error(error))
        for axis, drive in enumerate(drives):
            lib.offline_equip(
                self._rig, axis, drive.rated_torque_nm, drive.equipment.friction_volts or 0.0
            )
        if feedforward is not None:
            lib.offline_feedforward(
                self._rig,
                ffi.new("struct feedforward_gains[]", [_gains(axis) for axis in feedforward]),
            )

        self._faults = ffi.new("struct offline_fault[]", [_fault(fault) for fault in faults])
        if lib.offline_faults(self._rig, self._faults, len(faults)) != 0:
            raise InputError(
                f"simulation: cannot carry out the faults {list(faults)}: "
                "an axis of the program, ticks from 1 on, volts of a limit above 0"
            )

        self._orders = ffi.new("struct offline_order[]", [_order(order) for order in orders])
        if lib.offline_orders(self._rig, self._orders, len(orders)) != 0:
            raise InputError(f"simulation: orders not by ascending tick: {list(orders)}")

    @property
    def stop(self) -> RigStop | None:
        """The last stop that was ordered, None: none yet."""
        ffi, lib = library()
        own = ffi.new("struct offline_stop *")
        lib.offline_stop_get(self._rig, own)
        if own.tick == FOR_EVER:
            return None
        return RigStop(
            own.tick,
            None if own.rest_tick == FOR_EVER else own.rest_tick,
            own.bound_us * 1e-6,
            own.from_q40_mm * MM_PER_Q40,
            own.rest_q40_mm * MM_PER_Q40,
        )

    def run(self, rows: NDArray[np.void]) -> None:
        """Fill `rows` (contiguous, of ROW) with the next ticks."""
        ffi, lib = library()
        if rows.dtype != ROW or not rows.flags.c_contiguous:
            raise ValueError("rows must be a contiguous array of ROW")
        error = lib.offline_run(
            self._rig, ffi.cast("struct offline_row *", ffi.from_buffer(rows)), rows.size
        )
        if error != 0:
            raise HodographError(
                f"simulation: the interpolator failed (code {error}): report a bug"
            )


def _gains(feedforward: Feedforward) -> dict[str, int]:
    """Struct feedforward_gains with the figures of the controller; the simulation adds the other fields."""
    return {
        "velocity_permille": feedforward.velocity_permille,
        "torque_per_acceleration_q16": feedforward.torque_per_acceleration_q16,
        "torque_per_velocity_q16": feedforward.torque_per_velocity_q16,
    }


def _fault(fault: OfflineFault) -> tuple[object, ...]:
    """As cffi takes a struct offline_fault."""
    if fault.kind not in FAULT_KINDS:
        raise InputError(f'simulation: there is no fault "{fault.kind}"; {", ".join(FAULT_KINDS)}')
    return (FAULT_KINDS.index(fault.kind), *astuple(fault)[1:])


def _order(order: OfflineOrder) -> tuple[object, ...]:
    """As cffi takes a struct offline_order."""
    if order.kind not in ORDER_KINDS:
        raise InputError(f'simulation: there is no order "{order.kind}"; {", ".join(ORDER_KINDS)}')
    return (ORDER_KINDS.index(order.kind), *astuple(order)[1:])


def _begin_error(code: int) -> str:
    _, lib = library()
    if lib.OFFLINE_ERR_INTERP < code < lib.OFFLINE_ERR_DRIVE:
        axis, error = divmod(lib.OFFLINE_ERR_DRIVE - code, 10)
        return f"drive of axis {axis + 1}: {text(lib.drive_error_text(-error))}: correct its file"
    return f"simulation: cannot set up (code {code}): report a bug"
