# SPDX-License-Identifier: MIT
"""Runs a job in chunks with the controller's code, without a bus (sim/offline/stream.h). Used by stream/simulation and
tests. No I/O. Changes its own object only; one thread.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import HodographError
from ..events import ANALOGUES
from .feed_override import FeedCommands
from .library import library, text
from .program import POINT, NativeFault, NativeLimits, kernel_code, limits_fields

OUTPUTS = np.dtype([("digital", "<u2"), ("analogue", "<i2", ANALOGUES)])
"""The outputs on the path at a setpoint, struct path_outputs_values of core/path_outputs.h."""

CACHE_BYTES = 8192
"""The coefficient cache of a small controller."""


class OfflineStream(FeedCommands):
    """Takes chunks (docs/reference/protocol.md 1.7) and gives setpoints. Chunks and commands take effect from the next
    tick.

    Keeps the memory of a chunk until a later chunk has taken over.
    """

    def __init__(
        self,
        kernel: str = "fixed",
        limits: NativeLimits | None = None,
        *,
        cache_bytes: int = CACHE_BYTES,
    ) -> None:
        """Raises InputError for an unknown kernel. If `limits` is None, only the limits of the program format apply.

        The setpoints do not depend on the size of the cache.
        """
        self._ffi, self._lib = library()
        self._kernel = self._lib.kernel_find(kernel_code(kernel))
        self._stream = self._ffi.new("struct offline_stream *")
        self._feed = self._ffi.addressof(self._stream, "feed")
        self._parts: list[tuple[Any, ...]] = []
        given = self._ffi.new("struct program_limits *", limits_fields(limits or NativeLimits()))
        self._cache = self._ffi.new("uint64_t[]", cache_bytes // 8)
        memory = self._ffi.cast("uint8_t *", self._cache)
        size = 8 * (cache_bytes // 8)
        self._lib.offline_stream_begin(self._stream, self._kernel, given, memory, size)

    def give(self, chunk: bytes) -> NativeFault | None:
        """Adds a chunk after the newest accepted one. Returns why it is refused; None: it is accepted. A refused one
        has no effect.
        """
        ffi, lib = self._ffi, self._lib
        part = ffi.new("struct offline_part *")
        buffer = ffi.from_buffer("uint8_t[]", chunk)
        fault = ffi.new("struct program_fault *")
        code = lib.offline_stream_check(self._stream, part, buffer, len(chunk), fault)
        if code != 0:
            return NativeFault(int(code), int(fault.index), text(lib.program_error_text(code)))
        if lib.offline_stream_add(self._stream, part) != 0:
            raise HodographError(
                "the coefficient cache is too small for a program with so many axes"
            )
        self._parts.append((part, buffer))
        return None

    def run(self, ticks: int, *, until_rest: bool = False) -> NDArray[np.void]:
        """Up to `ticks` setpoints as an array of POINT, (n,), with arc lengths of the job.

        Fewer if the job has ended or was stopped; with `until_rest` also at the end of a tail after which no chunk is
        known. Raises HodographError: the interpolator fails.
        """
        return self.run_with_outputs(ticks, until_rest=until_rest)[0]

    def run_with_outputs(
        self, ticks: int, *, until_rest: bool = False
    ) -> tuple[NDArray[np.void], NDArray[np.void]]:
        """As `run`, and also the outputs on the path at each setpoint as an array of OUTPUTS, (n,)."""
        points, values = np.zeros(ticks, dtype=POINT), np.zeros(ticks, dtype=OUTPUTS)
        made = self._lib.offline_stream_run(
            self._stream,
            ticks,
            until_rest,
            self._ffi.cast("struct interpolator_point *", self._ffi.from_buffer(points)),
            self._ffi.cast("struct path_outputs_values *", self._ffi.from_buffer(values)),
        )
        if made < 0:
            raise HodographError(f"stream: the interpolator fails (code {made}): report a bug")
        while self._parts and self._parts[0][0] != self._stream.active:
            self._parts.pop(0)
        return points[: int(made)], values[: int(made)]

    @property
    def waits(self) -> bool:
        """Whether it is at rest at the end of a tail, until the next chunk is taken over."""
        return bool(self._lib.feed_override_waits(self._feed))

    @property
    def sequence(self) -> int | None:
        """Sequence number of the executed chunk; None: the first has not begun."""
        active = self._stream.active
        return None if active == self._ffi.NULL else int(active.chunk.sequence)

    @property
    def takeovers(self) -> tuple[int, int]:
        """Number of takeovers in motion, and at rest."""
        return int(self._stream.moving), int(self._stream.resting)

    @property
    def underruns(self) -> int:
        """Number of rests at the end of a tail."""
        return int(self._stream.underruns)
