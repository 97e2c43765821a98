# SPDX-License-Identifier: MIT
"""The G-code programs that `make compare` gives to all peers: generated ones, and two that come with LinuxCNC. Used by
peers/compare and benchmarks/toolpaths. Reads these files and the examples.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path

import numpy as np

from hodograph.data import EXAMPLES
from hodograph.pipeline import load_pipeline

LINUXCNC_FILES = Path("/usr/share/linuxcnc/ncfiles")
WORDS = ("heart", "rectangle", "zigzag", "spiral", "3D_Chips")
"""One for each toolpath, as an option names it."""
_HEAD = "G21 G90 G17 G94\nF{feed:g}\n"


@dataclass(frozen=True)
class Toolpath:
    """A program with one feed word, mm/min.

    smooth  its points sample a smooth curve
    plain   G1, G2 and G3 from X0 Y0 with numbers, without parameters and inches
    """

    name: str
    feed_mm_min: float
    text: str
    smooth: bool
    plain: bool

    @property
    def word(self) -> str:
        """Of WORDS."""
        return self.name.split()[-1]

    @property
    def feed_mm_s(self) -> float:
        """The feed word."""
        return self.feed_mm_min / 60.0


def toolpaths(feed_mm_min: float) -> list[Toolpath]:
    """All programs with this feed."""
    found = [
        Toolpath("heart", feed_mm_min, _heart(feed_mm_min), True, True),
        Toolpath("rounded rectangle", feed_mm_min, rectangle(feed_mm_min), False, True),
        Toolpath("zigzag", feed_mm_min, zigzag(feed_mm_min), False, True),
    ]
    for name, lines in (("spiral", None), ("3D_Chips", 2000)):
        file = LINUXCNC_FILES / f"{name}.ngc"
        with file.open(encoding="utf-8", errors="replace") as text:
            kept = "".join(islice(text, lines))
        found.append(Toolpath(name, feed_mm_min, _with_feed(kept, feed_mm_min), False, False))
    return found


def _heart(feed: float) -> str:
    """The heart of examples/heart.toml, closed, in chords of 0.5 mm; it starts at X0 Y0."""
    spline = load_pipeline(EXAMPLES / "heart.toml").spline_result.spline
    count = round(spline.length_mm / 0.5)
    point = spline.point(np.linspace(0.0, spline.length_mm, count + 1)) - spline.point(0.0)
    lines = (f"G1 X{p.real:.5f} Y{p.imag:.5f}\n" for p in point[1:])
    return "".join(chain([_HEAD.format(feed=feed)], lines))


def rectangle(feed_mm_min: float) -> str:
    """100 mm x 60 mm with arcs of 5 mm, from the middle of a side."""
    moves = (
        "G1 X45 Y0", "G3 X50 Y5 I0 J5", "G1 X50 Y55", "G3 X45 Y60 I-5 J0", "G1 X-45 Y60",
        "G3 X-50 Y55 I0 J-5", "G1 X-50 Y5", "G3 X-45 Y0 I5 J0", "G1 X0 Y0",
    )  # fmt: skip
    return _HEAD.format(feed=feed_mm_min) + "\n".join(moves) + "\n"


def zigzag(feed_mm_min: float) -> str:
    """21 legs of 10 mm, with 20 corners of 90 degrees."""
    steps = [(10 * ((k + 1) // 2), 10 * (k // 2)) for k in range(1, 22)]
    return _HEAD.format(feed=feed_mm_min) + "".join(f"G1 X{x} Y{y}\n" for x, y in steps)


_FEED_WORD = re.compile(r"(?i)F\s*(\[[^\]]*\]|[\d.]+)")
_BLENDING = re.compile(r"(?i)G64\s*(P\s*[\d.]+)?")


def _with_feed(text: str, feed_mm_min: float) -> str:
    """A program with this feed word in place of its own, and without its own words of blending."""
    inches = re.search(r"(?i)\bG20\b", text) is not None
    word = f"F{feed_mm_min / 25.4 if inches else feed_mm_min:.6g}"
    return _FEED_WORD.sub(word, _BLENDING.sub("", text))
