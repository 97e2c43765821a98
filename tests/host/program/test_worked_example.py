# SPDX-License-Identifier: MIT
"""The worked example of the manual: its path file compiles to the bytes that the page prints."""

from __future__ import annotations

import re
from pathlib import Path

from hodograph.cli.main import main

ROOT = Path(__file__).resolve().parents[3]
PAGE = ROOT / "docs/reference/protocol.md"
_BYTES = re.compile(r"^    ([0-9a-f]{4})  ([0-9a-f]{2}(?: [0-9a-f]{2})*)", re.MULTILINE)


def test_the_page_prints_the_bytes_of_its_path_file(tmp_path: Path) -> None:
    section = PAGE.read_text(encoding="utf-8").split("### 1.9 ")[1].split("\n## ")[0]
    file, image = tmp_path / "line.toml", tmp_path / "line.hdgp"
    text = section.split("```toml\n")[1].split("```")[0]
    file.write_text(text.replace('"examples/', f'"{ROOT}/examples/'), encoding="utf-8")
    assert main(["compile", str(file), "-o", str(image)]) == 0
    data = image.read_bytes()
    rows = [(int(at, 16), bytes.fromhex(hexes)) for at, hexes in _BYTES.findall(section)]
    for at, printed in rows:
        assert printed.hex(" ") == data[at : at + len(printed)].hex(" "), f"at offset 0x{at:04x}"
    printed_at = {k for at, part in rows for k in range(at, at + len(part))}
    header, segment, piece, stop = 136, 104, 88, 16
    pieces = int.from_bytes(data[24:28], "little")
    shown = header + segment + piece
    first_stop = header + segment + pieces * piece
    assert printed_at == {*range(shown), *range(first_stop, first_stop + stop)}
