# SPDX-License-Identifier: MIT
"""Feed zones and reserve zones: the least of their values at each place. Run by pytest; no I/O."""

from __future__ import annotations

import numpy as np
import pytest

from hodograph.feed.limits import FeedZone, least_in_zones


@pytest.mark.parametrize("with_ends", [False, True])
@pytest.mark.parametrize("seed", range(20))
def test_as_each_zone_for_itself(seed: int, with_ends: bool) -> None:
    """Zones overlap, meet and lie outside; places are in no order, and many are ends of zones."""
    rng = np.random.default_rng(seed)
    ends = np.sort(rng.integers(0, 60, (int(rng.integers(0, 30)), 2)), axis=1) + np.array([0, 1])
    zones = [FeedZone(float(low), float(high), 1.0 + rng.random()) for low, high in ends]
    places = rng.choice([rng.integers(-5, 70, (9, 7)), rng.uniform(-5.0, 70.0, (9, 7))]).astype(
        float
    )
    least = np.full(places.shape, np.inf)
    for zone in zones:
        inside = (places > zone.from_mm) & (places < zone.to_mm)
        if with_ends:
            inside |= (places == zone.from_mm) | (places == zone.to_mm)
        least[inside] = np.minimum(least[inside], zone.feed_mm_s)
    found = least_in_zones(places, zones, [zone.feed_mm_s for zone in zones], with_ends=with_ends)
    np.testing.assert_array_equal(found, least)
