# SPDX-License-Identifier: MIT
"""Fault rules in a run without a bus. Run by pytest; writes to temporary folders."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from campaign_files import EXAMPLES

from hodograph.campaign.fault_rules import Fault, offline_fault
from hodograph.errors import InputError
from hodograph.faults.scenario import draw, load_scenario
from hodograph.native import FOR_EVER, OfflineFault

NODES = (2, 3)

GOOD = [
    ("encoder-freeze at=100 for=500 node=2", OfflineFault("encoder-freeze", 0, 100, 500)),
    ("encoder-jump at=7 node=3 counts=-40", OfflineFault("encoder-jump", 1, 7, FOR_EVER, -40.0)),
    ("encoder-jump at=7 for=2 node=3 counts=1", OfflineFault("encoder-jump", 1, 7, 2, 1.0)),
    ("saturate at=0 for=9 node=2 volts=0.3", OfflineFault("saturate", 0, 0, 9, 0.3)),
    ("load at=5 node=3 volts=-4.0", OfflineFault("load", 1, 5, 1, -4.0)),
    ("load at=5 for_ms=11 node=3 volts=1", OfflineFault("load", 1, 5, 6, 1.0)),
    ("drop at=5 id=0x203", OfflineFault("setpoint-lost", 1, 5, 1)),
    ("drop at=5 for=9 id=514 count=4", OfflineFault("setpoint-lost", 0, 5, 4)),
]

BAD = [
    ("sync-lost at=4", r"sync-lost needs a bus: use `hodograph faults`"),
    ("stop at=4 node=2", r"stop needs a bus"),
    ("load at=4 volts=1", r"not about the node of"),
    ("load at=4 node=9 volts=1", r"not about the node of"),
    ("load node=2 volts=1", r"at is missing"),
    ("load at=4 node=2", r"volts is missing"),
    ("load at=4 node=2 volts=much", r"volts=much is not a number"),
    ("load at=4 node=2 volts=nan", r"volts=nan is not a finite number"),
    ("load at=4 node=2 volts=1e999", r"volts=1e999 is not a finite number"),
    ("encoder-jump at=4 node=2 counts=1" + "0" * 400, r"is not a number"),
    ("load at=4 node=2 counts=1", r"counts has no place here"),
    ("load at=-1 node=2 volts=1", r"at=-1 is out of range"),
    ("load at=4 for=0 node=2 volts=1", r"for=0 is out of range"),
    ("drop at=4 id=0x182", r"not about setpoints"),
    ("drop at=4 id=0x202 p=0.5", r"p has no place here"),
]


@pytest.mark.parametrize(("rule", "expected"), GOOD)
def test_good_rules(rule: str, expected: OfflineFault) -> None:
    assert offline_fault(rule, NODES, 2000) == expected


@pytest.mark.parametrize(("rule", "message"), BAD)
def test_bad_rules(rule: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        offline_fault(rule, NODES, 1000)
    assert str(caught.value).startswith(f'rule "{rule}": ')
    assert not re.search(r"\n", str(caught.value))


def test_blank_rules_are_none(tmp_path: Path) -> None:
    file = tmp_path / "s.toml"
    file.write_text('text = "x"\npath = "p.toml"\nrules = [" ", "", "load at=5 node=3 volts=1"]\n')
    assert len(Fault("blank", load_scenario(file)).rules(0, 0, NODES, 1000)) == 1


def test_draws_are_those_of_the_faults_command() -> None:
    scenario = load_scenario(EXAMPLES / "faults" / "load.toml")
    rule = draw(scenario, 12).rules.strip()
    assert Fault("load", scenario).lines(5, 7) == [rule]
    assert Fault("load", scenario).rules(5, 7, NODES, 1000) == [offline_fault(rule, NODES, 1000)]
