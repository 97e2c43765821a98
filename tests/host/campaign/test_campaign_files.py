# SPDX-License-Identifier: MIT
"""Campaign files: every mistake gets one line that names file, key and remedy. Run by pytest; writes to
temporary folders.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from campaign_files import EXAMPLES, Write

from hodograph.campaign.definition import load_campaign
from hodograph.errors import InputError

PATHS = 'paths = ["path.toml"]\n'
DRAWN = PATHS + "samples = 2\n"

BAD = [
    ("", r"\[paths\] is missing: add paths ="),
    ("paths = []", r"\[paths\] must be a list"),
    ('paths = "path.toml"', r"\[paths\] must be a list"),
    ("paths = [3]", r"\[paths\] must be a text, but is 3"),
    ('paths = ["no.toml"]', r"\[paths\] names .*no\.toml, which is not there"),
    ('paths = ["path.toml", "path.toml"]', r"\[paths\] names path\.toml twice"),
    (PATHS + 'machine = "no.toml"', r"\[machine\] names .*no\.toml, which is not there"),
    (PATHS + 'kernel = "flota"', r'\[kernel\] cannot be "flota"; did you mean "float"\?'),
    (PATHS + 'profiles = ["quintik"]', r'\[profiles\] cannot be "quintik"; did you mean "quintic"'),
    (PATHS + "feeds_mm_s = [0]", r"\[feeds_mm_s\] must be from 0.001 to 4000, but is 0"),
    (PATHS + "samples = 0", r"\[samples\] must be from 1 to"),
    (PATHS + "samples = 3", r"\[samples\] is 3, but nothing is drawn: add \[vary\.FIGURE\]"),
    (PATHS + "sample = 3", r'\[sample\]: unknown key; did you mean "samples"\?'),
    (PATHS + "[vary.k_vf]\nuniform = [0, 1]", r"\[samples\] is missing, and k_vf is drawn"),
    (
        DRAWN + "[vary.gain_rad_s]\nuniform = [0, 1]",
        r'\[vary\] gain_rad_s: unknown key; did you mean "gain_rad_s_v"',
    ),
    (DRAWN + "[vary.k_vf]", r"\[vary\.k_vf\] .*needs one of values, .* but has nothing"),
    (DRAWN + "[vary.k_vf]\nvalues = [1]\nuniform = [0, 1]", r"but has values and uniform"),
    (DRAWN + "[vary.k_vf]\nuniform = [1, 0]", r"must be \[least, greatest\], but is \[1, 0\]"),
    (DRAWN + "[vary.k_vf]\nnormal = [1, 0]", r"must be \[mean, standard deviation above 0\]"),
    (DRAWN + "[vary.k_vf]\nuniform = 1", r"uniform must be two numbers"),
    (DRAWN + "[vary.k_vf]\nvalues = [1, 1]", r"values holds a number twice"),
    (DRAWN + "[vary.k_vf]\nvalues = []", r"values must be a list of numbers"),
    (DRAWN + '[vary.k_vf]\nvalues = [1]\naxis = "each"', r'axis cannot be "each" for a grid'),
    (
        DRAWN + '[vary.k_vf]\nvalues = [1]\naxis = "z"',
        r'axis cannot be "z"; use one of: x, y, all, each',
    ),
    (
        DRAWN + '[vary.k_vf]\nvalues = [1]\naxis = "both"',
        r'axis cannot be "both"; use one of: x, y, all, each',
    ),
    (
        'paths = ["path.toml", "{examples}/helix.toml"]',
        r"\[paths\] run on machines with the path axes x, y and x, y, z: make a campaign of each",
    ),
    (
        'paths = ["{examples}/helix.toml"]\n[[gains]]\nname = "a"\nk_vf = [1, 1]',
        r"\[gains 1\] k_vf must be three numbers",
    ),
    (
        PATHS + '[[gains]]\nname = "a"\nmachine = "{examples}/machines/mill.toml"',
        r"\[gains 1\] machine names .*mill.toml with 3 path axes, the machines of the paths have 2",
    ),
    (
        'paths = ["{examples}/index.toml"]',
        r"moves rotary axes alone: a campaign takes paths of x, y and z",
    ),
    (PATHS + "[[gains]]\nk_vf = 1", r"\[gains 1\] name is missing"),
    (
        PATHS + '[[gains]]\nname = "a"\n[[gains]]\nname = "a"',
        r'\[gains 2\] name "a" is there twice',
    ),
    (PATHS + '[[gains]]\nname = "a"\nk_vf = -1', r"\[gains 1\] k_vf must be from 0"),
    (PATHS + '[[gains]]\nname = "a"\nk_vf = [1]', r"\[gains 1\] k_vf must be two numbers"),
    (PATHS + '[[gains]]\nname = "a"\nk_xy = 1', r"\[gains 1\] k_xy: unknown key"),
    (
        PATHS + '[[faults]]\nname = "a"\n[[faults]]\nname = "a"',
        r'\[faults 2\] name "a" is there twice',
    ),
    (PATHS + '[[faults]]\nname = "a"\nscenario = "no"', r"\[faults 1\] scenario names .*no, which"),
    (
        PATHS + '[[faults]]\nname = "a"\nrules = ["sync-lost at=3"]',
        r"\[faults 1\] rules \"sync-lost at=3\": sync-lost needs a bus",
    ),
    (
        PATHS + '[[faults]]\nname = "a"\nrules = ["load at={t} node=2 volts=1"]',
        r"\[faults 1\] rules name what \[random\] does not give: 't'",
    ),
    (
        PATHS + '[[faults]]\nname = "a"\nrandom = { at = [5, 9] }',
        r"\[faults 1\] random is given without rules",
    ),
    (
        PATHS + '[[faults]]\nname = "a"\nrules = []\nrandom = 3',
        r"\[faults 1\] random must be a section",
    ),
    (
        PATHS + '[[faults]]\nname = "a"\nscenario = "{examples}/faults/kill-drives.toml"',
        r"\[faults 1\] scenario has an action of the host, which needs a bus",
    ),
    (
        'paths = ["path.toml"]\nsamples = 9000000\n[vary.k_vf]\nuniform = [0, 1]\n'
        '[[faults]]\nname = "a"\n[[faults]]\nname = "b"',
        r"makes 18000000 runs, more than 10000000: split it",
    ),
]


@pytest.mark.parametrize(("text", "message"), BAD)
def test_bad_files(write: Write, text: str, message: str) -> None:
    file = write(text)
    with pytest.raises(InputError, match=message) as caught:
        load_campaign(file)
    assert str(caught.value).startswith(f"{file}: ")
    assert "\n" not in str(caught.value)


def test_a_bad_path_file_is_named_in_the_message(write: Write) -> None:
    file = write(PATHS, path="[path]\n")
    with pytest.raises(InputError, match=r"path\.toml: "):
        load_campaign(file)
    file = write(
        PATHS, path="[path]\nclosed = false\ncontrol_points = [[0, 0], [1, 1], [2, 0], [3, 1]]"
    )
    with pytest.raises(InputError, match=r"path\.toml: .*\[feed\] is missing"):
        load_campaign(file)


@pytest.mark.parametrize(
    "file", sorted((EXAMPLES / "campaigns").glob("*.toml")), ids=lambda f: f.stem
)
def test_examples_are_good(file: Path) -> None:
    campaign = load_campaign(file)
    assert campaign.design.total > 0
    assert campaign.text != file.stem
    for number in (0, campaign.design.total - 1):
        campaign.design.run(number)


def test_the_fingerprint_is_of_all_that_counts(write: Write) -> None:
    first = load_campaign(write(DRAWN + "[vary.k_vf]\nuniform = [0, 1]"))
    assert load_campaign(first.file).fingerprint == first.fingerprint
    changed = [
        load_campaign(write(DRAWN + "seed = 2\n[vary.k_vf]\nuniform = [0, 1]")),
        load_campaign(write(DRAWN + "[vary.k_vf]\nuniform = [0, 2]")),
    ]
    path = (first.file.parent / "path.toml").read_text()
    file = write(DRAWN + "[vary.k_vf]\nuniform = [0, 1]", path=re.sub("= 100", "= 90", path))
    changed.append(load_campaign(file))
    assert len({c.fingerprint for c in (first, *changed)}) == 4
