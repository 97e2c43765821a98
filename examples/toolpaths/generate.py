# SPDX-License-Identifier: MIT
"""Makes the toolpaths of this folder. Run by hand (`python generate.py`), and used by tests. Writes the files below.
Lengths in mm, feeds in mm/min.

pocket.ngc     a plate with two pockets, a slot and four holes: arcs, helices, a drilling cycle, two tools
engraving.ngc  a sign: cubic Bézier curves (G5), a NURBS (G5.2) and lines, between rapid moves
dispensing.ngc a bead of adhesive round a lid: outputs switch with the moves, pressure by an analogue output
surface.ngc    a wavy surface, finished in lines of short chords, as CAM systems write it
five_axes.ngc  a groove that winds up a dome; the tool leans (A) while the table turns (C)
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

SAFE_Z = 5.0
_NOTE = (
    "made by generate.py, read by commands of hodograph, of which run and stream move axes along it"
)


def pocket() -> Iterator[str]:
    """Two round pockets by helix and spiral, a slot with round ends, four holes."""
    yield from (
        f"(plate with pockets, {_NOTE})",
        "G21 G17 G90 G94 G64 P0.01",
        "T1 M6 (end mill 6 mm)",
        "G43 H1",
        "S12000 M3 M8",
    )
    for x, y, radius in ((30.0, 30.0, 13.0), (80.0, 30.0, 9.0)):
        yield f"G0 X{x + 2:g} Y{y:g}\nG0 Z1"
        for depth in (-1, -2, -3):
            yield f"G3 X{x + 2:g} Y{y:g} Z{depth} I-2 J0 F600 (helix down)"
        yield "F1200"
        reach = 2.0
        while reach + 2.0 <= radius - 3.0:  # half circles outwards, each 1 mm wider
            yield f"G3 X{x - reach - 1:g} Y{y:g} I{-(2 * reach + 1) / 2:g} J0"
            reach += 1.0
            yield f"G3 X{x + reach + 1:g} Y{y:g} I{(2 * reach + 1) / 2:g} J0"
            reach += 1.0
        yield f"G3 I{-reach:g} J0 (finish)"
        yield f"G0 Z{SAFE_Z:g}"
    yield "G0 X30 Y60\nG0 Z1\nG1 Z-2 F300\nF1200"
    yield "G1 X80\nG3 X80 Y66 J3\nG1 X30\nG3 X30 Y60 J-3"
    yield f"G0 Z{SAFE_Z:g}\nM9 M5\nT2 M6 (drill 4 mm)\nG43 H2\nS4000 M3 M8"
    yield "G98 G83 X8 Y8 Z-8 R1 Q2.5 F200\nX102\nY72\nX8\nG80"
    yield f"G0 Z{SAFE_Z:g}\nM9 M5\nM30"


def engraving() -> Iterator[str]:
    """A frame with round corners, a wave of Bézier curves, and a leaf as a NURBS."""
    yield from (f"(sign, {_NOTE})", "G21 G17 G90 G94 G64 P0.01", "S18000 M3")
    yield "G0 X5 Y0 Z2\nG1 Z-0.3 F300\nF1500"
    yield "G1 X85\nG3 X90 Y5 J5\nG1 Y35\nG3 X85 Y40 I-5\nG1 X5\nG3 X0 Y35 J-5\nG1 Y5\nG3 X5 Y0 I5"
    yield "G0 Z2\nG0 X10 Y10\nG1 Z-0.3 F300\nF1500"
    for k in range(7):
        rise = 6 if k % 2 == 0 else -6
        yield f"G5 I5 J{rise} P-5 Q{rise} X{20 + 10 * k} Y10"
    yield "G0 Z2\nG0 X15 Y25\nG1 Z-0.3 F300\nF1500"
    yield "G5.2 P1 L4\nX35 Y38 P1\nX60 Y36 P2\nX75 Y25 P1\nX60 Y14 P2\nX35 Y16 P1\nX15 Y25 P1\nG5.3"
    yield f"G0 Z{SAFE_Z:g}\nM5\nM30"


def dispensing() -> Iterator[str]:
    """Round the rim of a lid; the valve opens and closes with moves, so that the bead begins and ends on the move."""
    yield from (
        f"(bead of adhesive, {_NOTE})",
        "G21 G17 G90 G94 G64 P0.05",
        "M68 E0 Q2.5 (pressure, bar)",
    )
    for x in (0.0, 120.0):
        yield f"(lid at X{x:g})\nG0 X{x + 20:g} Y10 Z3\nG1 Z0.4 F600\nG4 P0.05"
        yield f"M62 P0 (valve opens with the next move)\nG1 X{x + 90:g} F3000"
        yield f"G3 X{x + 100:g} Y20 J10\nG1 Y70\nG3 X{x + 90:g} Y80 I-10"
        yield f"M67 E0 Q3 (more pressure on the long side)\nG1 X{x + 20:g}"
        yield f"M67 E0 Q2.5\nG3 X{x + 10:g} Y70 J-10\nG1 Y20\nG3 X{x + 20:g} Y10 I10"
        yield f"M63 P0 (valve closes with the next move: 3 mm over the start)\nG1 X{x + 23:g}\nG0 Z10"
    yield "M65 P0\nM68 E0 Q0\nM30"


def surface() -> Iterator[str]:
    """Lines along x over z = waves, 0.5 mm from chord to chord, to and fro."""

    def height(x: float, y: float) -> float:
        return 3.0 * math.sin(x / 9.0) * math.cos(y / 13.0) - 3.0

    yield from (
        f"(surface, ball end mill 6 mm, {_NOTE})",
        "G21 G17 G90 G94 G64 P0.01",
        "S18000 M3",
        f"G0 X0 Y0 Z{SAFE_Z:g}",
    )
    yield f"G1 Z{height(0, 0):.3f} F600\nF6000"
    for row in range(41):
        columns = range(121) if row % 2 == 0 else range(120, -1, -1)
        for column in columns:
            x, y = 0.5 * column, 1.0 * row
            yield f"X{x:g} Y{y:g} Z{height(x, y):.3f}"
    yield f"G0 Z{SAFE_Z:g}\nM5\nM30"


def five_axes() -> Iterator[str]:
    """One turn up a dome in chords of about 0.5 mm; A and C turn with X, Y and Z."""
    yield from (
        f"(groove round a dome, X Y Z A C, {_NOTE})",
        "G21 G17 G90 G94 G64 P0.01",
        "S18000 M3",
        f"G0 X30 Y0 Z{SAFE_Z:g}",
        "G1 Z0 F600",
        "F1500",
    )
    count = 300
    for k in range(1, count + 1):
        t = k / count
        radius, angle = 30.0 - 14.0 * t * t, 2.0 * math.pi * t
        x, y = radius * math.cos(angle), radius * math.sin(angle)
        lean = 12.0 * math.sin(0.5 * math.pi * t) ** 2
        yield f"X{x:.4f} Y{y:.4f} Z{12 * t:.4f} A{lean:.4f} C{360 * t:.4f}"
    yield f"G0 Z{12 + SAFE_Z:g}\nM5\nM30"


def main() -> None:
    """Write all files."""
    for write in (pocket, engraving, dispensing, surface, five_axes):
        path = Path(__file__).with_name(f"{write.__name__}.ngc")
        path.write_text("".join(f"{line}\n" for line in write()), encoding="utf-8")


if __name__ == "__main__":
    main()
