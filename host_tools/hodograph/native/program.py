# SPDX-License-Identifier: MIT
"""Opens, checks and interpolates a program image with the controller's own code (firmware/core). Used by many modules
of host_tools. No I/O.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import HodographError, InputError
from ..events import ANALOGUES, EVENT, Events
from ..names import FIRST_AXIS_SHIFT, KERNELS
from .library import library, text

AXES = 6
"""Greatest number of path axes, PROGRAM_AXES of core/program.h."""

Counts = int | Sequence[int]
"""Counts of a mm, the same for all axes, or for each axis (for a rotary axis counts of a degree)."""

POINT = np.dtype(
    [
        ("arc_length_q40_mm", "<i8"),
        ("feed_q32_mm_s", "<i8"),
        ("position_q40", "<i8", (AXES,)),
    ]
)
"""One interpolated point, struct interpolator_point of core/interpolator.h: unrounded output of a kernel.

`position_q40` is 0 beyond the program's path axes; mm * 2^40, or degrees * 2^40 of an extra rotary axis.
"""


@dataclass(frozen=True)
class NativeLimits:
    """The limits of a controller: struct program_limits. 0, except for the travel: no limit.

    Those of travel and axes have one number for each path axis, travel in mm * 2^40; period in us, feed and velocity in
    um/s, acceleration in um/s^2, jerk in mm/s^3. Axes that are not given have no limits. `axis_count` is the number of
    path axes of the machine (0: any). `chunk` 1: a program may begin in motion, as in a chunk of a stream.
    """

    period_us: int = 0
    feed_um_s: int = 0
    acceleration_um_s2: int = 0
    jerk_mm_s3: int = 0
    min_q40_mm: tuple[int, ...] = ()
    max_q40_mm: tuple[int, ...] = ()
    stop_time_ms: int = 0
    axis_velocity_um_s: tuple[int, ...] = ()
    axis_acceleration_um_s2: tuple[int, ...] = ()
    axis_jerk_mm_s3: tuple[int, ...] = ()
    axis_count: int = 0
    chunk: int = 0


@dataclass(frozen=True)
class NativeFault:
    """The first rule that a program breaks: code of core/program_rules.h, segment or piece, meaning."""

    code: int
    index: int
    text: str


def kernel_code(kernel: str) -> int:
    """The code of a kernel's name; raises InputError."""
    if kernel not in KERNELS:
        raise InputError(f'kernel: "{kernel}" is none; use one of: {", ".join(KERNELS)}')
    return KERNELS.index(kernel)


class NativeProgram:
    """A program image as the firmware reads it.

    Opening checks size, magic, version, counts and CRC. `check` applies every other rule; interpolating a
    program that does not pass it is refused.
    """

    def __init__(self, image: bytes) -> None:
        """Open `image` (docs/reference/protocol.md section 1); raises InputError when it cannot be read."""
        ffi, lib = library()
        self.image = bytes(image)
        self._buffer = ffi.from_buffer("uint8_t[]", self.image)
        self.pointer = ffi.new("struct program *")
        code = lib.program_open(self.pointer, self._buffer, len(self.image))
        if code != 0:
            raise InputError(
                f"program image: {text(lib.program_error_text(code))}: compile it again (code {code})"
            )
        self._accepted = False
        self._precomputed: dict[int, tuple[Any, Any]] = {}

    @property
    def period_us(self) -> int:
        """Period of the setpoints, us."""
        return int(self.pointer.header.period_us)

    @property
    def axis_count(self) -> int:
        """Number of path axes: 2 in the plane, 3 and more in space."""
        return int(self.pointer.header.axis_count)

    @property
    def first_axis(self) -> int:
        """The machine's number of the program's first axis; above 0: the program moves rotary axes alone."""
        return int(self.pointer.header.flags) >> FIRST_AXIS_SHIFT

    @property
    def segment_count(self) -> int:
        """Number of PH segments."""
        return int(self.pointer.header.segment_count)

    @property
    def ticks(self) -> int:
        """Number of setpoints, ceil(duration / period) + 1."""
        _, lib = library()
        return int(lib.program_ticks(self.pointer))

    @property
    def duration_q32_s(self) -> int:
        """Duration, s * 2^32."""
        return int(self.pointer.header.duration_q32_s)

    @property
    def events(self) -> Events:
        """The outputs that switch on the path, by place."""
        count = int(self.pointer.header.event_count)
        end = int(self.pointer.header.image_size)
        return np.frombuffer(self.image, EVENT, count, end - EVENT.itemsize * count)

    def check(self, limits: NativeLimits | None = None) -> NativeFault | None:
        """The controller's check of all rules; None: accepted, so that it may be interpolated as well."""
        ffi, lib = library()
        given = limits or NativeLimits()
        c_limits = ffi.new("struct program_limits *", limits_fields(given))
        fault = ffi.new("struct program_fault *")
        code = lib.program_check(self.pointer, c_limits, fault)
        if code == 0:
            self._accepted = True
            return None
        return NativeFault(int(code), int(fault.index), text(lib.program_error_text(code)))

    def accept_as(self, other: NativeProgram) -> None:
        """Marks the program as accepted if `other` is. The caller ensures that the integers of both differ only by a
        shift of all points, and that points and boxes of this one are within range and travel
        (`program.check.leaves_range`). No other rule depends on the place.
        """
        self._accepted = other._accepted

    def require(self) -> None:
        """Raise InputError unless the program passes `check` (without limits of a machine)."""
        if self._accepted:
            return
        fault = self.check()
        if fault is not None:
            raise InputError(
                f"program image: {fault.text} (code {fault.code}, number {fault.index}): compile it again"
            )

    def precomputed(self, kernel: str) -> Any:
        """The program with precomputed coefficients for a kernel, `struct program *`; valid as long as this object.

        The coefficients are made once (core/coefficients.h). Raises InputError for an unknown kernel and for a
        program that does not pass `check`.
        """
        self.require()
        code = kernel_code(kernel)
        if code not in self._precomputed:
            ffi, lib = library()
            made_for = lib.kernel_find(code)
            size = lib.coefficients_size(self.pointer, made_for)
            records = ffi.new("uint64_t[]", (size + 7) // 8)
            own = ffi.new("struct program *", self.pointer[0])
            if lib.coefficients_make_in(own, made_for, records, size) != 0:
                raise HodographError("coefficients: their size is not what it was: report a bug")
            self._precomputed[code] = (own, records)
        return self._precomputed[code][0]

    def tick_times_q42_s(self, tick0: int = 0, count: int | None = None) -> NDArray[np.uint64]:
        """Program times of `count` ticks from `tick0` on (default: to the last), s * 2^42, (count,)."""
        ffi, lib = library()
        n = self.ticks - tick0 if count is None else count
        times = np.empty(n, dtype=np.uint64)
        lib.offline_times(self.pointer, tick0, n, ffi.from_buffer("uint64_t[]", times))
        return times

    def points(self, kernel: str, times_q42_s: NDArray[np.uint64]) -> NDArray[np.void]:
        """Points at any program times, as an array of POINT, (n,); ascending times are fastest.

        Raises InputError for an unknown kernel and for a program that does not pass `check`.
        """
        ffi, lib = library()
        program = self.precomputed(kernel)
        times = np.ascontiguousarray(times_q42_s, dtype=np.uint64)
        points = np.zeros(times.size, dtype=POINT)
        interp = ffi.new("struct interpolator *")
        begun = lib.interpolator_begin(interp, program)
        made = begun or lib.offline_points(
            interp,
            times.size,
            ffi.from_buffer("uint64_t[]", times),
            1,
            ffi.cast("struct interpolator_point *", ffi.from_buffer(points)),
            ffi.NULL,
        )
        if made != 0:
            raise InputError(f"kernel {kernel}: cannot interpolate this program (code {made})")
        return points

    def outputs(
        self, arc_length_q40_mm: NDArray[np.int64], feed_q32_mm_s: NDArray[np.int64]
    ) -> tuple[NDArray[np.uint16], NDArray[np.int16]]:
        """Levels (n,) of the digital outputs and values (n, 3) of the analogue ones at setpoints from the first on.

        Arrays are (n,): arc length and feed along the path at each setpoint, as a run gives them.
        """
        ffi, lib = library()
        arc = np.ascontiguousarray(arc_length_q40_mm, dtype=np.int64)
        feed = np.ascontiguousarray(feed_q32_mm_s, dtype=np.int64)
        digital = np.zeros(arc.size, dtype=np.uint16)
        analogue = np.zeros((arc.size, ANALOGUES), dtype=np.int16)
        if not len(self.events):
            return digital, analogue
        state = ffi.new("struct path_outputs *")
        lib.path_outputs_begin(state, self.pointer, -1)
        for k, (place, speed) in enumerate(zip(arc.tolist(), feed.tolist(), strict=True)):
            lib.path_outputs_step(state, place, speed)
            digital[k] = state.values.digital
            analogue[k] = list(state.values.analogue)
        return digital, analogue

    def setpoints(
        self, kernel: str, counts_per_mm: Counts, tick0: int = 0, count: int | None = None
    ) -> tuple[NDArray[np.void], NDArray[np.int32]]:
        """Points (n,) of POINT and setpoints in counts (n, axis_count) of `count` ticks from `tick0` on.

        `counts_per_mm`: of all axes, or of each; for a rotary axis those of a degree.
        """
        points = self.points(kernel, self.tick_times_q42_s(tick0, count))
        return points, counts_from_q40_mm(
            points["position_q40"][:, : self.axis_count], counts_per_mm
        )

    def counts_at(self, kernel: str, counts_per_mm: Counts, tick: int = 0) -> list[int]:
        """The setpoint of one tick, in counts by axis; tick 0 is the start of the program."""
        _, setpoints = self.setpoints(kernel, counts_per_mm, tick, 1)
        found: list[int] = setpoints[0].tolist()
        return found


def limits_fields(given: NativeLimits) -> dict[str, object]:
    """The fields of a struct program_limits for cffi. Axes that are not given have the whole travel of the format."""
    fields = {name: getattr(given, name) for name in given.__dataclass_fields__}
    for name, far in (("min_q40_mm", -(2**52)), ("max_q40_mm", 2**52)):
        fields[name] = (*fields[name], *[far] * (AXES - len(fields[name])))
    return fields


def counts_by_axis(counts_per_mm: Counts, axes: int) -> tuple[int, ...]:
    """Counts of a mm, or of a degree, of each of so many axes. Raises InputError: they are for other axes."""
    if isinstance(counts_per_mm, int):
        return (counts_per_mm,) * axes
    if len(counts_per_mm) != axes:
        raise InputError(f"counts of {len(counts_per_mm)} axes are given, the program has {axes}")
    return tuple(counts_per_mm)


def counts_from_q40_mm(q40_mm: NDArray[np.int64], counts_per_mm: Counts) -> NDArray[np.int32]:
    """Bus counts of positions in mm * 2^40, any shape: round half up, saturated (core/counts.h).

    With counts for each axis the axis is the last index.
    """
    ffi, lib = library()
    if not isinstance(counts_per_mm, int):
        each = counts_by_axis(counts_per_mm, q40_mm.shape[-1])
        if len(set(each)) == 1:
            return counts_from_q40_mm(q40_mm, each[0])
        columns = [counts_from_q40_mm(q40_mm[..., k], one) for k, one in enumerate(each)]
        return np.stack(columns, axis=-1)
    source = np.ascontiguousarray(q40_mm, dtype=np.int64)
    counts = np.empty(source.shape, dtype=np.int32)
    lib.offline_counts(
        source.size,
        ffi.from_buffer("int64_t[]", source),
        counts_per_mm,
        ffi.from_buffer("int32_t[]", counts),
    )
    return counts
