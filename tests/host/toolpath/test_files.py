# SPDX-License-Identifier: MIT
"""Toolpath files of every kind on the command line: the right reader, options that fit it, and clear messages. Run by
pytest; starts processes, and writes to temporary folders.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from hodograph.cli.main import main
from hodograph.toolpath.files import ReadOptions, read_toolpath
from hodograph.toolpath.moves import ProgramEnd, StraightMove

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
MILL = str(EXAMPLES / "machines" / "mill.toml")
POINTS = "0 0\n10 0\n10 5\n0 5\n"
SVG = """<svg xmlns="http://www.w3.org/2000/svg" width="40mm" height="30mm" viewBox="0 0 40 30">
<g id="cut"><circle id="c" cx="20" cy="15" r="5"/><text>a</text></g>
<path id="l" d="M0 30 L8 30 L8 24"/>
</svg>
"""
DXF = """0\nSECTION\n2\nENTITIES\n0\nLINE\n5\nA1\n8\ncut\n10\n0\n20\n0\n11\n8\n21\n6\n0\nENDSEC\n0\nEOF\n"""
TEXTS = {
    "p.csv": "x,y\n" + POINTS.replace(" ", ","),
    "p.txt": POINTS,
    "d.svg": SVG,
    "d.dxf": DXF,
    "G.NGC": "F600\nG1 X8 Y6\nM2\n",
    "no_f.nc": "G94\nG1 X8 Y6\nM2\n",
}


@pytest.fixture(autouse=True)
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """All of TEXTS, in the present directory."""
    monkeypatch.chdir(tmp_path)
    for name, text in TEXTS.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def imported(capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, object]:
    """What import prints of a file."""
    capsys.readouterr()
    status = main(["import", *words, "--machine", MILL, "--json"])
    out, err = capsys.readouterr()
    assert status == 0, err
    found: dict[str, object] = json.loads(out)
    return found


@pytest.mark.parametrize(
    ("words", "length_mm"),
    [
        (("p.csv", "--feed", "20"), 25.0),
        (("p.txt", "--feed", "20", "--closed"), 30.0),
        (("p.txt", "--feed", "20", "--unit", "cm", "--scale", "0.5"), 125.0),
        (("d.svg", "--feed", "20", "--id", "l"), 14.0),
        (("d.svg", "--feed", "20", "--id", "l", "--scale", "2"), 28.0),
        (("d.dxf", "--feed", "20", "--unit", "mm", "--layer", "cut"), 10.0),
        (("d.dxf", "--feed", "20", "--unit", "in"), 254.0),
        (("p.txt", "--feed", "20", "--columns=-,x"), 5.0),
        (("p.csv", "--feed", "20", "--columns", "z, -"), 20.0),
        (("G.NGC",), 10.0),
        (("no_f.nc", "--feed", "20"), 10.0),
    ],
)
def test_every_kind_is_read_with_its_options(
    capsys: pytest.CaptureFixture[str], words: tuple[str, ...], length_mm: float
) -> None:
    assert imported(capsys, *words)["length_mm"] == pytest.approx(length_mm, abs=0.05)


@pytest.mark.parametrize("name", ["cut", "0"])
def test_layers_of_a_drawing_have_feeds(capsys: pytest.CaptureFixture[str], name: str) -> None:
    """Two lines of 10 mm, on two layers; the path between them is the same."""
    second = DXF.partition("0\nLINE")[2].partition("0\nENDSEC")[0].replace("8\ncut", "8\n0")
    second = second.replace("\nA1\n", "\nA2\n").replace("11\n8", "11\n-8")
    Path("two.dxf").write_text(DXF.replace("0\nENDSEC", f"0\nLINE{second}0\nENDSEC"))
    words = ("two.dxf", "--unit", "mm", "--feed", "20")
    before, after = imported(capsys, *words), imported(capsys, *words, "--feed-of", f"{name}=2")
    more_s = float(str(after["duration_s"])) - float(str(before["duration_s"]))
    assert more_s == pytest.approx(10.0 / 2.0 - 10.0 / 20.0, rel=0.05)


def test_noise_of_points_is_their_tolerance(capsys: pytest.CaptureFixture[str]) -> None:
    rough = imported(capsys, "p.csv", "--feed", "20", "--noise", "0.2")
    assert 10.0 < float(str(rough["deviation_bound_um"])) < 200.0
    exact = imported(capsys, "p.csv", "--feed", "20", "--noise", "0.002", "--tolerance", "0.2")
    assert float(str(exact["deviation_bound_um"])) < 2.0


def test_switches_of_the_operator(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Block delete and optional stop, as a machine's panel has them."""
    file = tmp_path / "part.ngc"
    file.write_text("F1200\nG1 X10\nM1\n/G1 X30\nX20\nM2\n")
    both = ("--block-delete", "--skip-optional-stops")
    assert imported(capsys, str(file))["length_mm"] == pytest.approx(40.0)
    assert imported(capsys, str(file), *both)["length_mm"] == pytest.approx(20.0)
    assert imported(capsys, str(file), both[0])["sections"] == 2
    assert imported(capsys, str(file), *both)["sections"] == 1


def test_what_was_left_out_is_a_note(capsys: pytest.CaptureFixture[str]) -> None:
    notes = imported(capsys, "d.svg", "--feed", "20", "--layer", "cut")["notes"]
    assert isinstance(notes, list)
    assert notes[0].startswith('d.svg:2: left out: element "text"')
    assert len([note for note in notes if "left out" in note]) == 1


def test_rapid_moves_of_a_drawing_are_lifted() -> None:
    read = read_toolpath(Path("d.svg"), ReadOptions(feed_mm_s=20.0, lift_mm=3.0))
    commands = list(read)
    assert isinstance(commands[-1], ProgramEnd)
    rapids = [one for one in commands if isinstance(one, StraightMove) and one.feed is None]
    assert max(one.end[2] for one in rapids) == 3.0


def test_standard_input_is_gcode() -> None:
    words = [sys.executable, "-m", "hodograph", "import", "-", "--machine", MILL, "--json"]
    run = subprocess.run(words, input=TEXTS["G.NGC"], capture_output=True, text=True, check=True)
    assert json.loads(run.stdout)["length_mm"] == pytest.approx(10.0)
    run = subprocess.run(words, input="G1 X1 Q\n", capture_output=True, text=True, check=False)
    assert run.returncode == 2
    assert "hodograph: -:1:" in run.stderr


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("simulate p.csv", "p.csv:3:1: no feed: give one (--feed MM/S)"),
        ("simulate d.svg", "d.svg: a drawing has no feed: add --feed MM/S"),
        ("simulate d.dxf --feed 20", "give it, as by --unit mm"),
        ("simulate d.dxf --feed 20 --unit ell", '"ell" is no unit'),
        ("simulate d.svg --feed 20 --layer x", 'no layer "x"'),
        ("simulate d.svg --feed 20 --closed", "--closed is for .csv, .txt"),
        ("simulate d.svg --feed 20 --feed-of x=2", 'a feed for "x"'),
        ("simulate d.svg --feed 20 --feed-of 2", '"2" is not NAME=MM/S'),
        ("simulate p.txt --feed 20 --feed-of x=2", "--feed-of is for .dxf, .svg"),
        ("simulate p.txt --feed 20 --columns x,q", 'columns: "q" is not one of x, y'),
        ("simulate d.svg --feed 20 --noise 1", "--noise is for .csv, .txt"),
        ("simulate p.txt --feed 20 --noise -1", "noise: -1 mm is not"),
        ("simulate G.NGC --gap 1", "--gap is for .dxf, .svg"),
        (
            "simulate p.csv --feed 20 --skip-optional-stops",
            "--skip-optional-stops is for .ngc, .nc",
        ),
        ("simulate none.svg --feed 20", "none.svg: cannot be read: No such file"),
        ("simulate none.csv --feed 20", "none.csv: no such file"),
        ("import part.toml", "part.toml: no toolpath by the end of its name"),
        ("feed G.NGC", "G.NGC: is a toolpath, which only"),
        ("goto G.NGC", "stream take: hodograph run G.NGC, or give a path file"),
        ("rig d.svg", "d.svg: is a toolpath, which only"),
    ],
)
def test_messages(capsys: pytest.CaptureFixture[str], words: str, message: str) -> None:
    machine = [] if words.split()[0] in ("goto", "rig") else ["--machine", MILL]
    words_of = words.split() if words.startswith("feed") else [*words.split(), *machine]
    assert main(words_of) == 2
    err = capsys.readouterr().err
    assert message in err
    assert err.count("\n") == 1


def test_options_of_toolpaths_are_not_for_path_files(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", str(EXAMPLES / "alpha.toml"), "--scale", "2"]) == 2
    assert "--scale is for toolpaths" in capsys.readouterr().err
