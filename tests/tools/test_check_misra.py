# SPDX-License-Identifier: MIT
"""tools/misra/check_misra.py: where a deviation applies, and that a deviation that nothing needs is reported. Run by
pytest; reads tools/misra/deviations.txt and docs/validation/testing.md.
"""

import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools" / "misra"))

import check_misra  # noqa: E402

OUTPUT = """\
firmware/core/a.c:7: misra-c2012-15.5
firmware/port/linux/b.c:9: misra-c2012-21.6
build/generated/od.h:3: misra-c2012-2.5
firmware/core/a.c:9: variableScope
"""


def _judge(deviations: str) -> list[str]:
    return check_misra.judge(OUTPUT, check_misra.read_deviations(deviations))


def test_a_rule_broken_without_a_deviation_is_named_with_its_place() -> None:
    assert _judge("15.5 * early returns\n") == ["firmware/port/linux/b.c:9: MISRA C:2012 rule 21.6"]


def test_a_deviation_holds_in_its_place_only() -> None:
    assert _judge("15.5 * early\n21.6 firmware/port/* messages\n") == []
    assert len(_judge("15.5 * early\n21.6 firmware/core/* messages\n")) == 2


def test_a_deviation_that_nothing_needs_is_reported() -> None:
    (complaint,) = _judge("# why\n15.5 * early\n21.6 * messages\n2.5 * of generated files\n")
    assert "nothing deviates from rule 2.5" in complaint


def test_a_deviation_without_a_reason_is_refused() -> None:
    with pytest.raises(ValueError, match="no reason"):
        check_misra.read_deviations("15.5 *\n")


def test_the_page_names_the_rules_with_deviations() -> None:
    """And no others: docs/validation/testing.md, the last table of its section."""
    text = (ROOT / "docs/validation/testing.md").read_text(encoding="utf-8")
    table = text.split("| reason | rules |")[1].split("\n\n")[0]
    cells = [row.split("|")[2] for row in table.splitlines() if row.count("|") == 3]
    named = [rule for cell in cells for rule in re.findall(r"\d+\.\d+", cell)]
    listed = check_misra.read_deviations(check_misra.DEVIATIONS.read_text(encoding="utf-8"))
    assert len(named) == len(set(named))
    assert set(named) == {deviation.rule for deviation in listed}
