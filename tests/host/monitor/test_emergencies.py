# SPDX-License-Identifier: MIT
"""A storm of emergency frames is reported in a few lines, the same ones however the frames come in. Run by pytest;
starts and writes nothing.
"""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
import pytest

from hodograph.bus.capture.frames import RECORD_DTYPE, Frames
from hodograph.monitor.emergencies import MOST_REPORTED, Emergencies

BEGIN_US = 946_684_800_000_000


def frames(*reported: tuple[float, int, int]) -> Frames:
    """Emergency frames: time in s, node, code; node 0: a SYNC."""
    array = np.zeros(len(reported), dtype=RECORD_DTYPE)
    for row, (time_s, node, code) in zip(array, reported, strict=True):
        row["id"], row["length"] = 0x080 + node, 8
        row["data"][:] = list(struct.pack("<H6x", code))
        row["time_us"] = BEGIN_US + round(1e6 * time_s)
    return array


def texts(events: list[dict[str, Any]]) -> list[str]:
    return [event["text"] for event in events]


def test_each_node_and_code_is_reported_once_a_window() -> None:
    found = Emergencies().feed(frames((0, 0, 0), (0, 2, 0x8611), (0, 3, 0x3220), (0, 2, 0)))
    assert [event["text"].split(":")[0] for event in found] == ["node 2", "node 3", "node 2"]
    assert "(0x8611)" in found[0]["text"]
    assert [event["fault"] for event in found] == [True, True, False]


STORM = frames(*[(k / 12_500, 2, 0x8210) for k in range(25_000)], (3.5, 0, 0))
"""Two seconds of it, and a SYNC."""


@pytest.mark.parametrize("size", [1, 7, 500, 12_499, 12_500, 12_501, 25_001])
def test_a_storm_is_counted_the_same_in_all_pieces(size: int) -> None:
    emergencies, reported = Emergencies(), []
    step = max(size, 50)  # single frames around the ends of the windows only: they take their time
    pieces = list(range(0, 12_450, step)) + list(range(12_450, 12_550, size))
    for start, end in zip(pieces, [*pieces[1:], 25_001], strict=True):
        reported += texts(emergencies.feed(STORM[start:end]))
    first, more, again, rest = reported
    assert "(0x8210)" in first
    assert again == first
    assert more == rest == "12499 more emergency frames in 1.0 s"
    assert emergencies.feed(frames((5.0, 0, 0))) == []


def test_a_window_ends_without_frames_where_the_present_is_known() -> None:
    emergencies = Emergencies()
    (reported,) = texts(emergencies.feed(frames((0.0, 2, 0x8210), (0.1, 2, 0x8210)), BEGIN_US))
    assert "(0x8210)" in reported
    assert emergencies.feed(frames(), BEGIN_US + 999_999) == []
    assert emergencies.feed(frames(), None) == []
    assert texts(emergencies.feed(frames(), BEGIN_US + 1_000_000)) == [
        "1 more emergency frames in 1.0 s"
    ]


def test_a_clock_that_was_set_back_begins_a_window() -> None:
    emergencies = Emergencies()
    emergencies.feed(frames((3600.0, 2, 0x8210), (3600.0, 2, 0x8210)))
    reported = texts(emergencies.feed(frames((0.0, 2, 0x8210))))
    assert reported[0] == "1 more emergency frames in 1.0 s"
    assert "(0x8210)" in reported[1]
    assert len(reported) == 2


def test_many_codes_at_once_are_bounded() -> None:
    emergencies = Emergencies()
    found = emergencies.feed(frames(*[(0, 2, 0x1000 + i) for i in range(200)]))
    assert len(found) == MOST_REPORTED
    (rest,) = emergencies.feed(frames((1.0, 0, 0)))
    assert rest["text"] == f"{200 - MOST_REPORTED} more emergency frames in 1.0 s"
