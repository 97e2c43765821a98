# SPDX-License-Identifier: MIT
"""Feed pieces in halves are the same feed. Run by pytest; starts and writes nothing."""

from pathlib import Path

import numpy as np
import pytest

from hodograph.feed.pieces import FeedPieces, exponents, halved
from hodograph.program.image import decode

EXAMPLES = Path(__file__).resolve().parents[2] / "data" / "programs"
PROGRAM = decode((EXAMPLES / "alpha_quintic.hdgp").read_bytes())


def values(pieces: FeedPieces, times_s: np.ndarray, order: int) -> np.ndarray:
    """Arc length (order 0, mm) or a derivative of it at times of the program."""
    begins = np.concatenate(([0.0], np.cumsum(pieces.duration_q32_s * 2.0**-32)[:-1]))
    row = np.clip(np.searchsorted(begins, times_s, side="right") - 1, 0, len(pieces) - 1)
    unit = np.ldexp(1.0, exponents(pieces.duration_q32_s))[row]
    out = np.empty(times_s.size)
    for i, k in enumerate(row):
        powers = np.concatenate(([pieces.start_q40[k]], pieces.c_q40[k])) * 2.0**-40
        slope = np.polynomial.Polynomial(powers)
        for _ in range(order):
            slope = slope.deriv()
        out[i] = slope((times_s[i] - begins[k]) / unit[i]) / unit[i] ** order
    return out


@pytest.mark.parametrize("seed", range(4))
def test_the_feed_stays_what_it_was(seed: int) -> None:
    rng = np.random.default_rng(seed)
    pieces = PROGRAM.pieces
    for _ in range(3):
        pieces = halved(pieces, rng.random(len(pieces)) < 0.4, PROGRAM.length_q40)
    assert len(pieces) > PROGRAM.piece_count
    assert pieces.total_q32_s == PROGRAM.pieces.total_q32_s
    times = rng.uniform(0.0, PROGRAM.duration_s, 300)
    for order, most in enumerate((2.0**-39, 2.0**-28, 2.0**-14, 2.0**-4)):
        off = np.abs(values(pieces, times, order) - values(PROGRAM.pieces, times, order))
        assert off.max() <= most, order


def test_what_is_not_chosen_keeps_its_bits_and_halves_their_bounds() -> None:
    old = PROGRAM.pieces
    chosen = np.zeros(len(old), dtype=np.bool_)
    chosen[5] = True
    new = halved(old, chosen, PROGRAM.length_q40)
    assert list(new)[:5] == list(old)[:5]
    assert list(new)[7:] == list(old)[6:]
    assert new.duration_q32_s[5:7].sum() == old.duration_q32_s[5]
    assert new.duration_q32_s[5] == old.duration_q32_s[5] // 2
    for half in (new[5], new[6]):
        assert half.override_factor_q14 == old[5].override_factor_q14
        assert half.override_rate_codes == old[5].override_rate_codes
        assert half.override_second_codes == old[5].override_second_codes
