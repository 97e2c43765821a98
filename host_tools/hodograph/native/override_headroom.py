# SPDX-License-Identifier: MIT
"""What the limits of the axes leave for a changing feed override, computed in C
(host_tools/numerics/override_headroom.h). Used by feed/override. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .library import library, numbers

Real = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Volts:
    """The limit of the volts: struct override_samples. Signed velocity and acceleration (A, C, K); reach (A,) and time
    constant (A,).
    """

    velocity: Real
    acceleration: Real
    reach: Real
    time_constant: Real


@dataclass(frozen=True, eq=False)
class OverrideSamples:
    """The motion of A axes in C cells with K samples each, and the limits: struct override_samples.

    piece                         (C,) of M pieces
    velocity, acceleration, jerk  magnitudes (A, C, K), above 0
    most_…                        limits (A, 1, 1) or (A, C, K); inf: none
    volts                         None: not limited
    """

    pieces: int
    piece: Index
    velocity: Real
    acceleration: Real
    jerk: Real
    most_acceleration: Real
    most_jerk: Real
    volts: Volts | None = None

    def rates(self, override: Real) -> tuple[Real, Real]:
        """Override rates (M,) at overrides (M,): as accelerations and volts allow, and as the whole headroom of the
        jerks allows; below 0: a limit leaves no headroom.
        """
        rest, jerk = np.full(self.pieces, np.inf), np.full(self.pieces, np.inf)
        _, lib = library()
        given, _ = self._struct
        at, kept = _powers(override)
        lib.override_rates(given, at, numbers(rest), numbers(jerk))
        del kept
        return rest, jerk

    def seconds(self, override: Real, rate: Real) -> Real:
        """Override accelerations (M,) at overrides (M,) with override rates (M,)."""
        second = np.full(self.pieces, np.inf)
        rate = np.ascontiguousarray(rate, dtype=np.float64)
        _, lib = library()
        given, _ = self._struct
        at, kept = _powers(override)
        lib.override_seconds(given, at, numbers(rate), numbers(second))
        del kept
        return second

    @cached_property
    def _struct(self) -> tuple[Any, list[Any]]:
        """A struct override_samples, and the arrays that it refers to."""
        ffi, _ = library()
        shape = self.velocity.shape
        limits = [self.most_acceleration, self.most_jerk]
        by_sample = any(one.size != shape[0] for one in limits)
        if by_sample:
            limits = [np.broadcast_to(one, shape) for one in limits]
        arrays = [self.velocity, self.acceleration, self.jerk, *limits]
        if self.volts is not None:
            own = self.volts
            arrays += [own.velocity, own.acceleration, own.reach, own.time_constant]
        kept = [np.ascontiguousarray(one, dtype=np.float64) for one in arrays]
        piece = np.ascontiguousarray(self.piece, dtype=np.int64)
        fields = (*shape, by_sample, numbers(piece), *map(numbers, kept))
        return ffi.new("struct override_samples *", fields), [piece, *kept]


def _powers(override: Real) -> tuple[Any, list[Real]]:
    """A struct override_powers, and the arrays that it refers to."""
    ffi, _ = library()
    kept = [np.ascontiguousarray(override**n, dtype=np.float64) for n in (1, 2, 3)]
    return ffi.new("struct override_powers *", tuple(map(numbers, kept))), kept
