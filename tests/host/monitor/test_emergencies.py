# SPDX-License-Identifier: MIT
"""A storm of emergency frames is told in a few lines."""

from __future__ import annotations

import struct

import numpy as np

from hodograph.bus.listening.frames import FRAME_DTYPE, Frames
from hodograph.monitor.emergencies import MOST_TOLD, Emergencies


def frames(*told: tuple[int, int]) -> Frames:
    array = np.zeros(len(told), dtype=FRAME_DTYPE)
    for row, (node, code) in zip(array, told, strict=True):
        row["id"], row["length"] = 0x080 + node, 8
        row["data"][:] = list(struct.pack("<H6x", code))
    return array


def test_each_node_and_code_is_told_once_a_window() -> None:
    found = Emergencies().feed(frames((0, 0), (2, 0x8611), (3, 0x3220), (2, 0)), 10.0)
    assert [event["text"].split(":")[0] for event in found] == ["node 2", "node 3", "node 2"]
    assert "(0x8611)" in found[0]["text"]
    assert [event["fault"] for event in found] == [True, True, False]


def test_a_storm_is_counted() -> None:
    emergencies, told = Emergencies(), []
    for k in range(50):  # two seconds
        told += emergencies.feed(frames(*[(2, 0x8210)] * 500), 0.04 * k)
    told += emergencies.feed(frames(), 3.0)
    texts = [event["text"] for event in told]
    assert sum("(0x8210)" in text for text in texts) == 2
    assert sum(int(text.split()[0]) for text in texts if "more emergency frames" in text) == 24998
    assert emergencies.feed(frames(), 5.0) == []


def test_many_codes_at_once_are_bounded() -> None:
    emergencies = Emergencies()
    found = emergencies.feed(frames(*[(2, 0x1000 + i) for i in range(200)]), 0.0)
    assert len(found) == MOST_TOLD
    (rest,) = emergencies.feed(frames(), 1.0)
    assert rest["text"] == f"{200 - MOST_TOLD} more emergency frames in 1.0 s"
