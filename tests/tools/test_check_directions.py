# SPDX-License-Identifier: MIT
"""The checker of directions: each kind of breach is found in a small tree, at its line. Run by pytest; writes to
temporary folders.
"""

from __future__ import annotations

from pathlib import Path

import pytest

import check_directions

GOOD = {
    "firmware/can/can_frame.h": "#include <stdint.h>\n",
    "firmware/core/interpolator.h": '#include "core/program.h"\n',
    "firmware/core/program.h": "#include <stdint.h>\n",
    "firmware/port/port.h": '#include "can/can_frame.h"\n',
    "firmware/port/linux/main.c": '#include "port/port.h"\n#include "port/linux/own.h"\n',
    "firmware/port/linux/own.h": "#include <poll.h>\n",
    "firmware/app/tick.c": '#include "core/interpolator.h"\n#include "od_controller.h"\n',
    "sim/plant/drive.h": "\n",
    "sim/offline/offline.c": '#include "plant/drive.h"\n#include "core/interpolator.h"\n',
    "host_tools/hodograph/__init__.py": "",
    "host_tools/hodograph/errors.py": "",
    "host_tools/hodograph/spline/__init__.py": "from .curve import Curve\n",
    "host_tools/hodograph/spline/curve.py": "from ..errors import E\n",
    "host_tools/hodograph/feed/__init__.py": "import numpy\n",
    "host_tools/hodograph/native/build_native.py": 'H = ("core/interpolator.h", "offline/offline.h")\n',
}


def tree(root: Path, more: dict[str, str]) -> list[str]:
    for name, text in (GOOD | more).items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    found = [*check_directions.check_c(root), *check_directions.check_python(root)]
    return [str(breach) for breach in found]


def test_a_good_tree_has_no_breach(tmp_path: Path) -> None:
    assert tree(tmp_path, {}) == []


@pytest.mark.parametrize(
    ("name", "text", "breach"),
    [
        ("firmware/core/x.c", '\n#include "canopen/nmt.h"\n', "x.c:2: firmware/core may not use"),
        ("firmware/core/x.c", "#include <stdio.h>\n", "x.c:1: firmware/core does without <stdio"),
        ("firmware/app/x.c", '#include "port/linux/own.h"\n', "may not use firmware/port/linux"),
        ("firmware/port/board/x.c", '#include "port/linux/own.h"\n', "firmware/port/* may not use"),
        ("firmware/port/linux/x.c", '#include "app/tick.h"\n', "firmware/port/* may not use"),
        (
            "sim/plant/x.c",
            '#include "core/interpolator.h"\n',
            "sim/plant may not use firmware/core",
        ),
        ("sim/offline/x.c", '#include "nowhere.h"\n', "is neither ours nor generated"),
        ("firmware/new/x.c", "", "x.c:1: this folder has no row"),
        ("host_tools/hodograph/spline/x.py", "import os\nfrom ..feed import y\n", "x.py:2: spline"),
        ("host_tools/hodograph/feed/x.py", "import hodograph.program.image\n", "x.py:1: feed may"),
        (
            "host_tools/hodograph/spline/x.py",
            "def f():\n    from .. import feed\n",
            "x.py:2: spline",
        ),
        ("host_tools/hodograph/new.py", "", "new.py:1: new has no row"),
        ("host_tools/hodograph/native/x.py", 'H = "canopen/nmt.h"\n', "x.py:1: the native module"),
    ],
)
def test_a_breach_is_found_at_its_line(tmp_path: Path, name: str, text: str, breach: str) -> None:
    targets = {"firmware/canopen/nmt.h": "", "firmware/app/tick.h": ""}
    (found,) = tree(tmp_path, targets | {name: text})
    assert breach in found


def test_circles_are_found(tmp_path: Path) -> None:
    found = tree(
        tmp_path,
        {
            "firmware/core/program.h": '#include "core/interpolator.h"\n',
            "host_tools/hodograph/spline/a.py": "from . import b\n",
            "host_tools/hodograph/spline/b.py": "from .a import x\n",
        },
    )
    assert len(found) == 2
    assert all("circle: " in breach for breach in found)
    assert (
        "firmware/core/interpolator -> firmware/core/program -> firmware/core/interpolator"
        in found[0]
    )


def test_a_source_and_its_header_are_one_module(tmp_path: Path) -> None:
    files = {
        "firmware/core/nearest.h": "",
        "firmware/core/nearest.c": '#include "core/nearest.h"\n#include "core/search.h"\n',
        "firmware/core/search.h": '#include "core/nearest.h"\n',
    }
    (found,) = tree(tmp_path, files)
    assert "circle: firmware/core/nearest -> firmware/core/search" in found


def test_the_tables_have_no_circle() -> None:
    """Else the rule against circles between packages would rest on files alone."""
    for rules in (check_directions.C_RULES, check_directions.PYTHON_RULES):
        left = {layer: {other for other in row if other in rules} for layer, row in rules.items()}
        while left:
            bottom = {layer for layer, row in left.items() if not row}
            assert bottom, f"circle among {sorted(left)}"
            left = {layer: row - bottom for layer, row in left.items() if layer not in bottom}
