# SPDX-License-Identifier: MIT
"""The worked example of the manual: its path file compiles to the bytes that the page prints. Run by pytest; writes to
temporary folders.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

from hodograph.cli.main import main
from hodograph.program import decode, encode

ROOT = Path(__file__).resolve().parents[3]
PAGE = ROOT / "docs/reference/protocol.md"
_BYTES = re.compile(r"^    ([0-9a-f]{4})  ([0-9a-f]{2}(?: [0-9a-f]{2})*)", re.MULTILINE)


def _example(folder: Path) -> bytes:
    """The image of the path file on the page."""
    file, image = folder / "line.toml", folder / "line.hdgp"
    text = _section("1.9").split("```toml\n")[1].split("```")[0]
    file.write_text(text.replace('"examples/', f'"{ROOT}/examples/'), encoding="utf-8")
    assert main(["compile", str(file), "-o", str(image)]) == 0
    return image.read_bytes()


def _section(number: str) -> str:
    return re.split("\n##+ ", PAGE.read_text(encoding="utf-8").split(f"# {number} ")[1])[0]


def _verify(section: str, data: bytes, sizes: tuple[int, int, int], *, header: bool) -> None:
    """The section prints these bytes: the header, if so, and the first record of each kind, of these sizes."""
    rows = [(int(at, 16), bytes.fromhex(hexes)) for at, hexes in _BYTES.findall(section)]
    for at, printed in rows:
        assert printed.hex(" ") == data[at : at + len(printed)].hex(" "), f"at offset 0x{at:04x}"
    printed_at = {k for at, part in rows for k in range(at, at + len(part))}
    begin, (segment, piece, stop) = 136, sizes
    first_stop = begin + segment + int.from_bytes(data[24:28], "little") * piece
    first = 0 if header else begin
    assert printed_at == {
        *range(first, begin + segment + piece),
        *range(first_stop, first_stop + stop),
    }


def test_the_page_prints_the_bytes_of_its_path_file(tmp_path: Path) -> None:
    _verify(_section("1.9"), _example(tmp_path), (104, 88, 16), header=True)


def test_the_page_prints_the_same_as_compact_records(tmp_path: Path) -> None:
    data = encode(replace(decode(_example(tmp_path)), compact=True))
    assert f"{len(data)} = 136 + 100 + 33 (69 + 12)" in _section("1.7.1")
    _verify(_section("1.7.1"), data, (100, 69, 12), header=False)
