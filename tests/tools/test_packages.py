# SPDX-License-Identifier: MIT
"""Sets of Debian packages: each one that the tree names is there, and the help of the tool names all. Run by pytest;
reads the files of the tree.
"""

from __future__ import annotations

import re
from pathlib import Path

import packages

ROOT = Path(__file__).resolve().parents[2]
NAMED = re.compile(r"""packages\.py[ ,'"]+([a-z][a-z0-9-]*)""")
"""A set after the name of the tool, as in `packages.py test` or `"packages.py", "test"`."""


def test_each_set_that_the_tree_names_is_there() -> None:
    folders = ("packaging", "tests", "tools", "docs", "firmware")
    files = [ROOT / "Makefile", ROOT / "README.md", ROOT / ".ci/run"]
    for folder in folders:
        for ending in ("mk", "py", "sh", "md"):
            files += (ROOT / folder).rglob(f"*.{ending}")
    named = {
        (str(file.relative_to(ROOT)), name)
        for file in files
        if file != Path(__file__)
        for name in NAMED.findall(file.read_text(encoding="utf-8"))
    }
    assert len({name for _, name in named}) >= 5
    assert {(file, name) for file, name in named if name not in packages.SETS} == set()


def test_the_help_names_all_sets() -> None:
    text = (packages.__doc__ or "").split("A set is ")[1].split("Missing")[0]
    assert set(re.findall(r"`([a-z0-9-]+)`", text)) == set(packages.SETS)
