# SPDX-License-Identifier: MIT
"""The reader of G-code compared with LinuxCNC's own interpreter, on its programs and on generated ones. Run by pytest;
starts rs274, which the first use downloads to build/linuxcnc, and writes to temporary folders.
"""

from __future__ import annotations

import random
import re
from pathlib import Path

import pytest

from hodograph.errors import ToolpathError
from hodograph.toolpath.gcode import Options, read_gcode
from hodograph.toolpath.moves import Command
from linuxcnc import TOOLS, Item, canonical, difference, programs, run_rs274, unpacked
from mutated_files import mutated

pytestmark = pytest.mark.long

_TOLERANCE_MM = 2e-3
"""The oracle prints four decimals, of inches too, and a position is the sum of up to four such numbers."""

_NO_END = "File ended with no percent sign"

_OUTSIDE = (
    r"is not supported \(",
    r"axis [UVW] is not supported",
    r"D words belong",
    r"M\d{3,} is unknown",
    r"M52",
    r"no subroutine o<\w+> in this file",
)
"""Refusals of what docs/reference/gcode.md calls outside: the oracle may read on there."""

_OTHERWISE = {
    # G43 in the block of M6: rs274 then takes up the position that it printed last, without the new offset.
    "mmount.ngc",
    "skeleton.ngc",
}


def ours(text: Path) -> tuple[list[Command], str]:
    found: list[Command] = []
    try:
        with text.open(encoding="utf-8", errors="surrogateescape", newline="\n") as lines:
            found.extend(read_gcode(lines, text.name, Options(tools=TOOLS, most_jumps=100_000)))
    except ToolpathError as error:
        return found, str(error)
    return found, ""


def _only_moves(items: list[Item]) -> list[Item]:
    return [item for item in items if item[0] in ("rapid", "straight") or item[0].startswith("arc")]


def disagreement(program: Path) -> str:
    """What speaks against the reader after both have read a program; empty if nothing does."""
    found, refusal = ours(program)
    said = run_rs274(program)
    mine = canonical(found)
    if refusal and any(re.search(each, refusal) for each in _OUTSIDE):
        # The oracle reads on, or refuses the same block for another reason.
        theirs = _only_moves(said.items)
        return difference(_only_moves(mine), theirs, _TOLERANCE_MM, is_part=True)
    if refusal:
        return "" if said.error else f"only we refuse: {refusal}"
    if said.error and _NO_END not in said.error:
        return f"only rs274 refuses: {said.error}"
    if said.error:
        mine = mine[:-1]
    return difference(mine, said.items, _TOLERANCE_MM)


def test_the_programs_that_come_with_linuxcnc() -> None:
    found = programs()
    assert len(found) > 100
    assert any(path.name == "3D_Chips.ngc" for path in found)
    wrong = {
        str(path.relative_to(unpacked())): text
        for path in found
        if path.name not in _OTHERWISE and (text := disagreement(path))
    }
    assert not wrong, "\n".join(f"{name}: {text}" for name, text in wrong.items())


_DEFAULT = re.compile(r"#(\d+)\s*\(\s*=?\s*(-?(?:\d+\.?\d*|\.\d+))")


def _with_call(program: Path) -> str | None:
    """The text of a file that only defines a subroutine, with a call of it; None for another file."""
    text = program.read_text(encoding="utf-8", errors="surrogateescape")
    name = re.search(
        rf"^\s*o<({re.escape(program.stem)})>\s*sub", text, re.IGNORECASE | re.MULTILINE
    )
    if name is None or re.search(r"^\s*m(?:2|30)\s*$", text, re.IGNORECASE | re.MULTILINE):
        return None
    given = {int(number): value for number, value in _DEFAULT.findall(text)}
    arguments = " ".join(f"[{given.get(number, '1')}]" for number in range(1, 31))
    head = "G20 G90 G17 G64 P0.001\nF10 S100 T1 M6\nG0 X0 Y0 Z1\n"
    return f"{head}{text}\no<{name[1]}> call {arguments}\nM2\n"


def test_the_subroutines_that_come_with_linuxcnc(tmp_path: Path) -> None:
    wrong, texts = {}, set()
    for program in programs():
        text = _with_call(program)
        if text is None or text in texts:
            continue
        texts.add(text)
        called = tmp_path / program.name
        called.write_text(text, encoding="utf-8", errors="surrogateescape")
        difference_found = disagreement(called)
        if difference_found:
            wrong[program.name] = difference_found
    assert len(texts) > 30
    assert not wrong, "\n".join(f"{name}: {text}" for name, text in wrong.items())


class _Writer:
    """Writes programs of blocks that are likely to be valid; a pure function of its seed."""

    def __init__(self, seed: int) -> None:
        self._random = random.Random(seed)
        self._label = 0
        # docs/reference/gcode.md, section "Different from LinuxCNC": one R and one retract mode for all cycles.
        self._r = self._random.randint(0, 5)
        self._retract = self._random.choice(["G98 ", "G99 "])

    def _number(self, size: float = 20.0) -> str:
        value = self._random.uniform(-size, size)
        kind = self._random.random()
        if kind < 0.1:
            return f"[{value:.3f} * cos[{self._random.randint(0, 90)}] + #<_y> / 7]"
        if kind < 0.15:
            return f"#{self._random.randint(31, 33)}"
        return self._random.choice([f"{value:.3f}", f"{value:.1f}", f"{value:.0f}."])

    def _axes(self, letters: str) -> str:
        chosen = [letter for letter in letters if self._random.random() < 0.5] or [letters[0]]
        return " ".join(letter + self._number() for letter in chosen)

    def _arc(self) -> str:
        code = self._random.choice(["G2", "G3"])
        turns = self._random.choice(["", "", f" P{self._random.randint(1, 3)}"])
        if self._random.random() < 0.4:
            return f"{code} {self._axes('XYZ')} R{self._random.choice([30, -30, 60, 25.5])}{turns}"
        centre = self._random.choice(["IJ", "IK", "JK"])
        words = " ".join(letter + self._number() for letter in centre)
        return f"{code} {words} {self._random.choice(['', 'Z1', 'A5', 'X3'])}{turns}"

    def _cycle(self) -> str:
        code = self._random.choice(["G81", "G82 P0.5", "G83 Q3"])
        letters = self._random.choice(["XY", "YZ", "ZX", "XYZ"])
        repeat = self._random.choice(["", "", " L2"])
        depth = self._random.randint(2, 9)
        return f"{self._retract}{code} {self._axes(letters)} Z-{depth} R{self._r}{repeat}"

    def _spline(self) -> str:
        kind = self._random.random()
        if kind < 0.4:
            return f"G5 X{self._number()} Y{self._number()} I1 J2 P-1 Q{self._number()}"
        if kind < 0.6:
            return f"G5.1 X{self._number()} Y{self._number()} I1 J2"
        points = "".join(f"X{self._number()} Y{self._number()} P1\n" for _ in range(4))
        return f"G5.2 P1 L3\n{points}G5.3"

    def _flow(self) -> str:
        self._label += 1
        label, inner = f"o{self._label}", self._block()
        return self._random.choice(
            [
                f"{label} repeat [{self._random.randint(0, 3)}]\n{inner}\n{label} endrepeat",
                f"{label} if [#31 GT {self._number()}]\n{inner}\n{label} else\n{self._block()}\n{label} endif",
                f"#32=0\n{label} while [#32 LT 2]\n#32=[#32+1]\n{inner}\n{label} endwhile",
                f"{label} sub\n{inner}\nX#1\n{label} endsub\n{label} call [{self._number()}]",
            ]
        )

    def _setting(self) -> str:
        system = self._random.randint(0, 9)
        return self._random.choice(
            [
                # After a change of units rs274 reads tool offset, Z and R of a cycle, and P of G64 in the new ones.
                "G49 G80 G64\nG20",
                "G49 G80 G64\nG21",
                "G90",
                "G91",
                "G17",
                "G18",
                "G19",
                "G90.1",
                "G91.1",
                "G94 F300",
                "G95 S100 F2",
                "G93",
                "G61",
                "G61.1",
                f"G64 P0.0{self._random.randint(1, 9)}",
                "G64 P0.1 Q0.02",
                f"G{self._random.choice(['54', '55', '56', '59', '59.1', '59.3'])}",
                f"G10 L2 P{system} {self._axes('XYZAC')}",
                f"G10 L2 P{system} R{self._random.choice([0, 0, 30, -90])}",
                f"G10 L20 P{system} {self._axes('XYZAC')}",
                f"G92 {self._axes('XYZAB')}",
                "G92.1",
                "G92.2",
                "G92.3",
                f"G43 H{self._random.randint(1, 9)}",
                f"G43.1 {self._axes('XYZ')}",
                "G49",
                "G80",
                f"#3{self._random.randint(1, 3)}={self._number()}",
                f"F{self._random.randint(1, 900)}",
            ]
        )

    def _command(self) -> str:
        return self._random.choice(
            [
                "M3 S100",
                "M4",
                "M5",
                "S250.5",
                "M7",
                "M8",
                "M9",
                "T2",
                # rs274 takes up the position that it printed last, without tool offsets and splines since then.
                "G0 X1 Y2 Z3\nT3\nM6",
                "M62 P3",
                "M63 P3",
                "M64 P1",
                "M65 P1",
                "M67 E1 Q2.5",
                "M68 E1 Q-2",
                "G4 P0.5",
                "M1",
                "(msg, hello)",
                "M48",
            ]
        )

    def _motion(self) -> str:
        kind = self._random.random()
        if kind < 0.35:
            feed = self._random.choice(["", "", "F500 "])
            return f"{self._random.choice(['G0 ', 'G1 ', ''])}{feed}{self._axes('XYZABC')}"
        if kind < 0.6:
            return self._arc()
        if kind < 0.7:
            return self._cycle()
        if kind < 0.8:
            return self._spline()
        return self._random.choice(
            [
                f"G53 G0 {self._axes('XYZ')}",
                f"G28 {self._axes('XYZ')}",
                "G30",
                "G28.1",
                "G30.1",
                f"G0 @{self._number()} ^{self._number(180)}",
                f"G1 ^{self._number(180)}",
            ]
        )

    def _block(self) -> str:
        kind = self._random.random()
        if kind < 0.6:
            return self._motion()
        return self._setting() if kind < 0.85 else self._command()

    def program(self) -> list[str]:
        """Pieces of a program; each is complete."""
        count = self._random.randint(5, 40)
        pieces = [
            self._flow() if self._random.random() < 0.08 else self._block() for _ in range(count)
        ]
        return ["G21 G90 F600", "#31=1.5 #32=2 #33=-3", *pieces]


SOUND = Path(__file__).resolve().parents[2] / "data" / "toolpaths" / "sound.ngc"


def _disagreement_of_mutated(program: Path, data: bytes) -> str:
    """What speaks against the reader where it reads a mutated program; empty if nothing does, or if it refuses."""
    program.write_bytes(data)
    found, refusal = ours(program)
    if refusal:
        return "" if re.match(rf"{program.name}:\d+:\d+: .", refusal) else f"no place: {refusal}"
    if b"G20" in data or b"M6" in data:
        return ""  # rs274 reads tool offsets in the new unit, and takes up the position that it printed last
    said = run_rs274(program)
    mine = canonical(found)
    if said.error and _NO_END not in said.error:
        return difference(_only_moves(said.items), _only_moves(mine), _TOLERANCE_MM, is_part=True)
    return difference(_only_moves(mine), _only_moves(said.items), _TOLERANCE_MM)


@pytest.mark.parametrize("part", range(100))
def test_mutated_programs_that_are_read_have_the_same_moves(part: int, tmp_path: Path) -> None:
    sound = SOUND.read_bytes()
    wrong = []
    for seed in range(part * 1000, part * 1000 + 1000):
        text = _disagreement_of_mutated(tmp_path / "mutated.ngc", mutated(sound, seed))
        wrong += [f"{seed}: {text}"] if text else []
    assert not wrong, "\n".join(wrong)


_STRICTER = (
    # docs/reference/gcode.md, section "Refused here, taken by LinuxCNC".
    r"inverse time",
    r"needs absolute coordinates",
    r"without rotation",
    r"would be used by",
    r"G53 needs",
    r"splines need plane XY",
    r"axis words without motion",
)


@pytest.mark.parametrize("part", range(10))
def test_generated_programs(part: int, tmp_path: Path) -> None:
    wrong = []
    for seed in range(part * 20, part * 20 + 20):
        program = tmp_path / f"{seed}.ngc"
        pieces: list[str] = []
        for piece in _Writer(seed).program():
            program.write_text("\n".join([*pieces, piece, "M2", ""]))
            refusal = ours(program)[1]
            if not refusal:
                pieces.append(piece)
            elif not any(re.search(each, refusal) for each in _STRICTER):
                said = run_rs274(program)
                wrong += [] if said.error else [f"{seed}: only we refuse: {refusal}"]
        program.write_text("\n".join([*pieces, "M2", ""]))
        text = disagreement(program)
        wrong += [f"{seed}: {text}"] if text else []
    assert not wrong, "\n".join(wrong)
