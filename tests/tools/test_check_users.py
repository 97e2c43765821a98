# SPDX-License-Identifier: MIT
"""The checker of users and effects: right lists pass, each kind of wrong list is found at its line, and so is each file
that does not name its users or its effects. Run by pytest; writes to temporary folders.
"""

from __future__ import annotations

from pathlib import Path

import pytest

import check_users

LICENCE = "/* SPDX-License-Identifier: MIT */\n"
FILES = {
    "firmware/core/counts.h": "struct counts {\n    int n;\n};\n\nint counts_from(int mm);\n",
    "firmware/core/counts.c": '#include "core/counts.h"\nint counts_from(int mm) { return mm; }\n',
    "firmware/app/tick.c": '#include "core/counts.h"\nint tick(void) { return counts_from(1); }\n',
    "firmware/app/state.h": '#include "core/counts.h"\nstruct state {\n    struct counts counts;\n};\n',
    "firmware/app/idle.c": '#include "core/counts.h"\n/* calls counts_from no more */\n',
    "firmware/app/far.c": '#include "app/state.h"\nint far(void) { return counts_from(2); }\n',
    "tests/unit/test_counts.c": '#include "core/counts.h"\nint main(void) { return counts_from(0); }\n',
    "host_tools/hodograph/__init__.py": "",
    "host_tools/hodograph/spline/__init__.py": "from .curve import Curve\n",
    "host_tools/hodograph/spline/curve.py": "class Curve: ...\n",
    "host_tools/hodograph/spline/quality.py": "from .curve import Curve\n",
    "host_tools/hodograph/feed.py": "from .spline import Curve\n",
    "host_tools/hodograph/api.py": "def f():\n    from hodograph.spline import Curve\n",
    "tools/soak.py": "from hodograph.spline.curve import Curve\n",
}


def found(root: Path, path: str, comment: str) -> list[str]:
    """What the check of lists prints for the tree with `comment` at the top of `path`."""
    return list(check_users.wrong_lists(tree_with(root, path, comment)))


def tree_with(root: Path, path: str, comment: str) -> check_users.Tree:
    """The tree with `comment` at the top of `path`."""
    for name, text in FILES.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    (root / path).write_text(comment + FILES[path])
    return check_users.Tree(root)


@pytest.mark.parametrize(
    "sentence",
    [
        "Used by app/tick and app/state.",
        "Used by app/tick.c (each period), and by app/state.h, which stores counts; pure.",
        "Used by app/tick, app/state and app/far: main loop.",  # far includes it through state.h
        "Used by firmware/app.",
        "Used by app/tick, app/state and tests/.",
        "Called by app/tick.",  # state.h has the struct only
        "Used by the tick of the controller.",  # no name: not compared
        "All functions are pure.",
    ],
)
def test_a_right_list_of_a_header(tmp_path: Path, sentence: str) -> None:
    comment = LICENCE + f"/*\n * counts: mm to counts. {sentence}\n */\n"
    assert found(tmp_path, "firmware/core/counts.h", comment) == []


@pytest.mark.parametrize(
    ("sentence", "verdict"),
    [
        ("Used by app/tick.", "missing: firmware/app/state"),
        ("Called by app/state.", "missing: firmware/app/tick; superfluous: app/state"),
        ("Used by firmware/app and\n * app/idle.", "superfluous: app/idle"),
        ("Used by firmware/app and sim/node.", "superfluous: sim/node"),
        ("Used by firmware/app and host tools.", "superfluous: host tools"),
        ("Used by firmware/app and counts.", "superfluous: counts"),
        (
            "Used by app/tick, app/state, app/far, tests and firmware/app.",
            "5 names, at most 4: name a folder, or remove the list",
        ),
        (
            "Used by the tick and app/idle.",
            "missing: firmware/app/state, firmware/app/tick; superfluous: app/idle",
        ),
    ],
)
def test_a_wrong_list_of_a_header(tmp_path: Path, sentence: str, verdict: str) -> None:
    comment = LICENCE + f"/*\n * counts: mm to counts.\n * {sentence} Pure.\n */\n"
    assert found(tmp_path, "firmware/core/counts.h", comment) == [
        f"firmware/core/counts.h:4: {verdict}"
    ]


@pytest.mark.parametrize(
    ("sentence", "verdict"),
    [
        ("Used by `quality`, feed.py and api.", ""),
        ("Used by spline/quality, feed, api and soak.", ""),
        ("Used by hodograph/.", ""),
        ("Used by quality and feed.", "missing: host_tools/hodograph/api"),
        ("Used by hodograph/ and errors.", "superfluous: errors"),
    ],
)
def test_a_list_of_a_module(tmp_path: Path, sentence: str, verdict: str) -> None:
    path = "host_tools/hodograph/spline/curve.py"
    expected = [f"{path}:2: {verdict}"] if verdict else []
    assert found(tmp_path, path, f'# SPDX\n"""A curve. {sentence}"""\n') == expected


def test_a_package_is_used_from_outside(tmp_path: Path) -> None:
    path = "host_tools/hodograph/spline/__init__.py"
    assert found(tmp_path, path, '"""Splines. Used by feed and api."""\n') == []
    assert found(tmp_path, path, '"""Splines. Used by feed, api and quality."""\n') == [
        f"{path}:1: superfluous: quality"
    ]


def test_a_header_of_the_native_module(tmp_path: Path) -> None:
    native = tmp_path / "host_tools/hodograph/native"
    native.mkdir(parents=True)
    (native / "build_native.py").write_text('HEADERS = ("core/counts.h",)\n')
    (native / "declarations.h").write_text("int counts_from(int mm);\n")
    comment = LICENCE + "/* counts: mm to counts. Called by app/tick{} */\n"
    assert found(tmp_path, "firmware/core/counts.h", comment.format(" and host tools.")) == []
    assert found(tmp_path, "firmware/core/counts.h", comment.format(".")) == [
        "firmware/core/counts.h:2: missing: host_tools/hodograph/native/declarations"
    ]


def test_the_list_of_a_source_is_that_of_its_header(tmp_path: Path) -> None:
    path = "firmware/core/counts.c"
    comment = LICENCE + "/* Implements core/counts.h: mm to counts. {} */\n"
    right = comment.format("Used by app/tick and app/state.")
    assert found(tmp_path, path, right) == []
    assert found(tmp_path, path, comment.format("Used by app/tick.")) == [
        f"{path}:2: missing: firmware/app/state"
    ]
    assert found(tmp_path, path, LICENCE + "/* A program. Started by tools/bench.py. */\n") == []


@pytest.mark.parametrize(
    ("path", "comment", "lacks"),
    [
        ("firmware/core/counts.c", LICENCE + "/* Counts. Used by app/tick. Pure. */\n", ()),
        ("firmware/core/counts.c", LICENCE + "/* Counts. Pure. */\n", ("users",)),
        ("firmware/core/counts.h", LICENCE + "/* Counts. Used by app/x. */\n", ("effects",)),
        ("firmware/core/counts.h", LICENCE, ("users", "effects")),
        ("tools/soak.py", '"""Long runs. Run by `make soak`. Starts processes."""\n', ()),
        ("tools/soak.py", '"""Long runs. Starts processes."""\n', ("users",)),
        ("tools/soak.py", "\n" * 40 + '"""Long. Used by x. No I/O."""\n', ("users", "effects")),
        ("tests/unit/test_counts.c", LICENCE, ("users", "effects")),
    ],
)
def test_users_and_effects_in_the_first_screen(
    tmp_path: Path, path: str, comment: str, lacks: tuple[str, ...]
) -> None:
    lines = [
        line
        for line in check_users.missing_sentences(tree_with(tmp_path, path, comment))
        if path in line
    ]
    assert len(lines) == len(lacks)
    assert all(f"does not name the {word}" in line for line, word in zip(lines, lacks, strict=True))
