# SPDX-License-Identifier: MIT
"""Chunks as the controller sees them: its check, and a job's setpoints with the takeovers (sim/offline/stream.h)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import HodographError, InputError
from .feed_override import State
from .library import library, text
from .program import NativeFault, NativeLimits, kernel_code, limits_fields


class NativeChunk:
    """A chunk that was opened: magic, version, size, flags and CRC are right."""

    def __init__(self, data: bytes) -> None:
        """Raises InputError: it cannot be read."""
        ffi, lib = library()
        self.data = bytes(data)
        self._buffer = ffi.from_buffer("uint8_t[]", self.data)
        self.pointer = ffi.new("struct chunk *")
        code = lib.chunk_open(self.pointer, self._buffer, len(self.data))
        if code != 0:
            raise InputError(f"chunk: {text(lib.program_error_text(code))} (code {code})")
        self._records: Any = None

    @property
    def last(self) -> bool:
        """The job ends with it."""
        return bool(self.pointer.flags & 2)

    def check(self, before: NativeChunk | None, limits: NativeLimits) -> NativeFault | None:
        """The controller's check of the program and of how it follows `before`; None: accepted."""
        ffi, lib = library()
        given = ffi.new("struct program_limits *", limits_fields(limits))
        fault = ffi.new("struct program_fault *")
        previous = ffi.NULL if before is None else before.pointer
        code = lib.chunk_check(self.pointer, previous, given, fault)
        if code == 0:
            return None
        return NativeFault(int(code), int(fault.index), text(lib.program_error_text(code)))

    def prepare(self, kernel: str) -> None:
        """Makes its coefficient records. Raises InputError: no such kernel."""
        ffi, lib = library()
        made_for = lib.kernel_find(kernel_code(kernel))
        own = ffi.addressof(self.pointer, "program")
        size = lib.coefficients_size(own, made_for)
        self._records = ffi.new("uint64_t[]", (size + 7) // 8)
        if lib.coefficients_make_in(own, made_for, self._records, size) != 0:
            raise HodographError("coefficients: their size is not what it was: report a bug")


class StreamRun:
    """A job tick by tick, from its first chunk."""

    def __init__(self, first: NativeChunk, kernel: str, counts_per_mm: int) -> None:
        """`first` has passed its check."""
        ffi, self._lib = library()
        self._ffi = ffi
        self._counts_per_mm, self._kernel = counts_per_mm, kernel
        self._stream = ffi.new("struct offline_stream *")
        self._feed = ffi.addressof(self._stream, "feed")
        self._axes = int(first.pointer.program.header.axis_count)
        first.prepare(kernel)
        self._now = first
        if self._lib.offline_stream_begin(self._stream, first.pointer) != 0:
            raise HodographError("stream: the interpolator does not begin: report a bug")

    @property
    def state(self) -> State:
        """After the last tick."""
        return State(self._lib.feed_override_state(self._feed))

    @property
    def waits(self) -> bool:
        """At rest at the end of a tail, until the next chunk comes."""
        return bool(self._lib.feed_override_waits(self._feed))

    def run(self, next_chunk: NativeChunk | None, ticks: int) -> tuple[NDArray[np.int32], bool]:
        """Setpoints (n, A) of the next ticks: up to the takeover of `next_chunk`, to the end of the job, or `ticks`; and
        whether it was taken over.
        """
        if next_chunk is not None and next_chunk._records is None:
            next_chunk.prepare(self._kernel)
        counts = np.empty((ticks, self._axes), dtype=np.int32)
        taken = self._ffi.new("uint32_t *")
        count = self._lib.offline_stream_run(
            self._stream,
            self._ffi.NULL if next_chunk is None else next_chunk.pointer,
            ticks,
            self._counts_per_mm,
            self._ffi.cast("int32_t *", self._ffi.from_buffer(counts)),
            taken,
        )
        if count < 0:
            raise HodographError(f"stream: the interpolator failed (code {count}): report a bug")
        if taken[0]:
            assert next_chunk is not None
            self._now = next_chunk
        return counts[:count], bool(taken[0])

    def hold(self) -> None:
        """To rest, until resumed."""
        self._lib.feed_override_hold(self._feed)

    def resume(self) -> None:
        """Back to the override."""
        self._lib.feed_override_resume(self._feed)

    def override(self, percent: int) -> None:
        """The override wanted."""
        self._lib.feed_override_set(self._feed, percent)
