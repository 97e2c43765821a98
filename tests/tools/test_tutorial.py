# SPDX-License-Identifier: MIT
"""docs/start/tutorial.md does what it says: its blocks run, print what stands below them, and leave its figures. Run by
pytest; starts the commands of the tutorial, and writes to a temporary folder.
"""

from __future__ import annotations

import re

import matplotlib as mpl
import pytest

import tutorial

mpl.use("Agg")
TEXT = tutorial.PAGE.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def results() -> list[tutorial.Result]:
    return list(tutorial.run(TEXT))


def test_blocks_print_what_the_page_says(results: list[tutorial.Result]) -> None:
    assert [(r.cell.line, r.output) for r in results] == [
        (r.cell.line, r.cell.output) for r in results
    ]


def test_every_block_and_image_of_the_page_is_a_cell(results: list[tutorial.Result]) -> None:
    assert len(results) == TEXT.count("```python\n") > 8
    assert sum(bool(r.cell.output) for r in results) == TEXT.count("```text\n")
    images = re.findall(r"\.\./images/([\w-]+)\.svg", TEXT)
    assert [r.cell.image for r in results if r.cell.image] == images
    assert len(set(images)) == len(images) == 3


def test_images_have_their_figure(results: list[tutorial.Result]) -> None:
    assert all(hasattr(r.figure, "savefig") for r in results if r.cell.image)
