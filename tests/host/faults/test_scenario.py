# SPDX-License-Identifier: MIT
"""Scenario files: read, drawn from by seed, and refused in one line where they are wrong. Run by pytest; starts
processes, and writes to temporary folders.
"""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from hodograph.errors import InputError
from hodograph.faults.scenario import draw, find_scenarios, load_scenario

ROOT = Path(__file__).resolve().parents[3]
FOLDER = ROOT / "examples" / "faults"
INJECTOR = [str(ROOT / "build/bin/hodograph-injector"), "--bus", "none0", "--bus", "none1"]
FRAMES = {"drop", "duplicate", "delay", "reorder", "corrupt", "short", "flood", "bus-off"}
DRIVES = {"stop", "restart", "heartbeat-stop", "fault", "saturate", "load", "limit-switch"}
ENCODERS = {"encoder-freeze", "encoder-jump", "encoder-fault"}

GOOD = """
text = "a test"
path = "path.toml"
rules = ["drop at={at} id={tpdo1} count={n}", "bus-off at={at} side={side} for_ms=40"]
[random]
at = [5, 9]
node = [3, 3]
n = [1, 4]
side = ["controller", "drives"]
[expect]
codes = [0x8130]
within_ticks = 7
"""


def written(folder: Path, text: str) -> Path:
    file = folder / "s.toml"
    file.write_text(text)
    return file


def injector(rules: Path) -> subprocess.CompletedProcess[str]:
    command = [*INJECTOR, "--rules", str(rules)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_a_seed_always_draws_the_same_and_seeds_differ(tmp_path: Path) -> None:
    scenario = load_scenario(written(tmp_path, GOOD))
    texts = [draw(scenario, seed).rules for seed in range(40)]
    assert texts == [draw(scenario, seed).rules for seed in range(40)]
    assert len(set(texts)) > 10
    assert {int(draw(scenario, seed).drawn["at"]) for seed in range(40)} == {5, 6, 7, 8, 9}
    assert {draw(scenario, seed).drawn["side"] for seed in range(40)} == {"controller", "drives"}


def test_names_become_rules(tmp_path: Path) -> None:
    case = draw(load_scenario(written(tmp_path, GOOD)), 1)
    first = case.rules.splitlines()[0]
    assert f"id={0x183} " in first
    assert f"at={case.at} " in first
    assert case.longest_ms == 40
    assert case.last_tick == case.at + 1
    assert case.scenario.expect.codes == (0x8130,)
    assert case.scenario.expect.within_ticks == 7
    assert case.scenario.expect.rest_ms > 10**6


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("{n}", "{m}", "'m'"),
        ("{n}", "{n[0]}", "between braces is a name"),
        ("{n}", "{n.imag.x}", "between braces is a name"),
        ("{n}", "{n!r}", "between braces is a name"),
        ("{n}", "{n:>9}", "between braces is a name"),
        ("{n}", "{0}", "between braces is a name"),
        ("{n}", "{n", "expected '}'"),
        ("[5, 9]", "[9, 5]", "at must be [least, greatest]"),
        ("[5, 9]", "7", "at must be"),
        ("[5, 9]", '["5", "nine"]', "at must be [least, greatest], two ticks"),
        ("for_ms=40", "for_ms=" + "4" * 5000, "a number that is too long"),
        ("[0x8130]", '["0x8130"]', "must be a list of numbers"),
        ("within_ticks", "in_ticks", "unknown key"),
        ('rules = ["drop', 'rules = [1, "drop', "must be a list of texts"),
        ("[expect]", '[host]\naction = "kill-everything"\n[expect]', "kill-everything"),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in GOOD
    with pytest.raises(InputError, match=r"s\.toml") as caught:
        load_scenario(written(tmp_path, GOOD.replace(old, new)))
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_unknown_name_lists_those_there_are() -> None:
    with pytest.raises(InputError, match=r"no scenario .nothing.; .*tpdo1-lost"):
        find_scenarios(FOLDER, ["nothing"])
    assert [s.name for s in find_scenarios(FOLDER, ["drive-stops"])] == ["drive-stops"]


def test_a_scenario_without_rules_is_one_too(tmp_path: Path) -> None:
    for name in ("path.toml", "other.toml", "machine.toml"):
        (tmp_path / name).write_bytes((FOLDER / name).read_bytes())
    (tmp_path / "killed.toml").write_text(
        'text = "x"\npath = "path.toml"\n[host]\naction = "kill-host"\n'
    )
    assert [s.name for s in find_scenarios(tmp_path, [])] == ["killed"]


def test_the_examples_have_every_kind_of_fault_and_rules_that_are_understood(
    tmp_path: Path,
) -> None:
    """The injector itself reads them: it complains of rules before it looks for a bus."""
    scenarios = find_scenarios(FOLDER, [])
    kinds = {rule.split()[0] for scenario in scenarios for rule in scenario.rules}
    assert kinds == FRAMES | DRIVES | ENCODERS
    for scenario in scenarios:
        for seed in range(3):
            file = tmp_path / "rules"
            file.write_text(draw(scenario, seed).rules)
            done = injector(file)
            assert done.returncode == 4, f"{scenario.name}: {done.stderr}"


def test_the_injector_names_file_and_line(tmp_path: Path) -> None:
    file = tmp_path / "rules"
    file.write_text("# fine\ndrop at=3\n")
    done = injector(file)
    assert done.returncode == 2
    assert done.stderr == f"hodograph-injector: {file}: line 2: drop needs id=\n"


def test_a_name_that_no_file_can_have(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no scenario"):
        find_scenarios(tmp_path, ["s" * 500])


@pytest.mark.parametrize("name", ["kill-one-drive", "kill-upload", "cut-upload"])
def test_an_action_without_its_names_is_refused(tmp_path: Path, name: str) -> None:
    """When the file is read, not in the middle of the runs."""
    text = (ROOT / "examples" / "faults" / f"{name}.toml").read_text()
    file = tmp_path / f"{name}.toml"
    file.write_text(_without_random(text))
    with pytest.raises(InputError, match=f'"{name}" needs'):
        load_scenario(file)


def _without_random(text: str) -> str:
    """The table [random] with a tick only."""
    head, rest = text.split("[random]", 1)
    _, *later = rest.split("\n[")
    return head + "[random]\nat = [5, 9]\n" + "".join(f"\n[{one}" for one in later)
