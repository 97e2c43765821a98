# SPDX-License-Identifier: MIT
"""Path files: what they mean, and that every mistake gets one line naming file, key and remedy. Run by pytest; writes
to temporary folders.
"""

from __future__ import annotations

import re
from math import inf
from pathlib import Path

import numpy as np
import pytest

from hodograph.config import load_path_file
from hodograph.errors import InputError, PlanError
from hodograph.feed import AxisLimits, FeedZone
from hodograph.pipeline import load_pipeline

ROOT = Path(__file__).resolve().parents[3]

GOOD = """
[path]
closed = false
control_points = [[0, 0], [12, 18], [24, 27], [36, 9]]
[feed]
profile = "exponential"
nominal_mm_s = 100
ramp_time_s = 0.1
n_c = 5
[limits]
jerk_mm_s3 = 5e4
policy = "report"
"""


def write(folder: Path, text: str) -> Path:
    file = folder / "path.toml"
    file.write_text(text)
    return file


def test_good_file(tmp_path: Path) -> None:
    found = load_path_file(write(tmp_path, GOOD))
    assert found.name == "path"
    assert not found.path.closed
    assert not found.path.through
    np.testing.assert_array_equal(found.path.points, [0, 12 + 18j, 24 + 27j, 36 + 9j])
    assert (found.feed.profile, found.feed.nominal_mm_s, found.feed.ramp_time_s) == (
        "exponential",
        100.0,
        0.1,
    )
    assert found.feed.n_c == 5.0
    assert (found.limits.jerk_mm_s3, found.limits.acceleration_mm_s2) == (5e4, None)
    assert found.limits.policy == "report"
    assert found.machine_file is None


FULL = (
    GOOD
    + """
centripetal_mm_s2 = 1500
volts = 4.5
[limits.axis]
velocity_mm_s = 200
jerk_mm_s3 = [5e4, 4e4]
[[limits.cap]]
from_mm = 0
to_mm = 12.5
feed_mm_s = 40
[[limits.cap]]
from_mm = 10
to_mm = 20
feed_mm_s = 50
"""
)


def test_every_limit(tmp_path: Path) -> None:
    limits = load_path_file(write(tmp_path, FULL)).limits
    assert (limits.centripetal_mm_s2, limits.volts) == (1500.0, 4.5)
    assert limits.axis == AxisLimits((200.0, 200.0), None, (5e4, 4e4))
    assert limits.zones == (FeedZone(0.0, 12.5, 40.0), FeedZone(10.0, 20.0, 50.0))


OPTIMAL = "[path]\nclosed = true\nthrough = [[0,0],[1,0],[1,1]]\n[feed]\nprofile = 'optimal'\n"


def test_optimal_needs_no_nominal_feed(tmp_path: Path) -> None:
    found = load_path_file(write(tmp_path, OPTIMAL + "[limits]\nvolts = 4\n"))
    assert found.feed.optimal
    assert found.feed.nominal_mm_s == inf
    capped = OPTIMAL + "nominal_mm_s = 30\n[limits.axis]\njerk_mm_s3 = 1e4\n"
    assert load_path_file(write(tmp_path, capped)).feed.nominal_mm_s == 30.0
    cap = "[[limits.cap]]\nfrom_mm = 0\nto_mm = 1\nfeed_mm_s = 9\n"
    for text in (OPTIMAL, OPTIMAL + cap):
        with pytest.raises(
            InputError, match=r'profile "optimal" has no limit to keep: name a machine'
        ):
            _ = load_pipeline(write(tmp_path, text)).plan


def test_defaults(tmp_path: Path) -> None:
    text = "[path]\nclosed = true\nthrough = [[0,0],[1,0],[1,1]]\n[feed]\nnominal_mm_s=1\nramp_time_s=1\n"
    found = load_path_file(write(tmp_path, text))
    assert found.path.through
    assert found.path.ends == "cubic"
    assert found.feed.n_c == "optimise"
    assert found.limits.policy == "respect"


@pytest.mark.parametrize("name", ["alpha", "heart", "star"])
def test_examples_load(name: str) -> None:
    found = load_path_file(ROOT / "examples" / f"{name}.toml")
    assert found.machine_file is not None
    assert found.machine_file.is_file()


def test_machine_file_is_relative_to_the_path_file(tmp_path: Path) -> None:
    (tmp_path / "machines").mkdir()
    (tmp_path / "machines" / "m.toml").write_text("")
    found = load_path_file(write(tmp_path, GOOD + '[machine]\nfile = "machines/m.toml"\n'))
    assert found.machine_file == tmp_path / "machines" / "m.toml"


MISTAKES = [
    ("[path", "", r"not valid TOML"),
    ("closed = false", "closed = 1", r"\[path\] closed must be true or false"),
    ("closed = false\n", "", r"\[path\] closed is missing: add closed = true or false"),
    ("closed = false", "closd = false", r'closd.*unknown key; did you mean "closed"\?'),
    ("[limits]", "[limit]", r'\[limit\]: unknown key; did you mean "limits"\?'),
    ("[36, 9]]", "[36, 9, 1]]", r"control_points point 3 must be \[x, y\]"),
    ("[36, 9]]", "[36, nan]]", r"control_points point 3 holds nan"),
    ("[36, 9]]", "[36, inf]]", r"control_points point 3 holds inf"),
    ("[36, 9]]", '[36, "9"]]', r'control_points point 3 holds "9"'),
    ("[36, 9]]", "[36, true]]", r"control_points point 3 holds True"),
    ("[36, 9]]", "[36, 1e9]]", r"point 3 holds 1e\+09: at most 4096 mm"),
    (
        "control_points = [[0, 0], [12, 18], [24, 27], [36, 9]]",
        "control_points = []",
        r"must be a list",
    ),
    ("control_points = [[0, 0], [12, 18], [24, 27], [36, 9]]", "", r"control_points is missing"),
    (
        "closed = false",
        "closed = false\nthrough = [[0, 0]]",
        r"through is given together with control_points",
    ),
    (
        "closed = false",
        "closed = false\nends = 'natural'",
        r"ends applies to open paths with through",
    ),
    ('"exponential"', '"exponentail"', r'profile.*did you mean "exponential"\?'),
    (
        '"exponential"',
        "3",
        r"profile cannot be 3; use one of: quintic, exponential, minimax, optimal",
    ),
    ("nominal_mm_s = 100", "nominal_mms = 100", r'did you mean "nominal_mm_s"\?'),
    (
        "nominal_mm_s = 100",
        'nominal_mm_s = "fast"',
        r'nominal_mm_s must be a number, but is "fast"',
    ),
    (
        "nominal_mm_s = 100",
        "nominal_mm_s = nan",
        r"nominal_mm_s must be a finite number, but is nan",
    ),
    ("nominal_mm_s = 100", "nominal_mm_s = -1", r"nominal_mm_s must be from 0\.001 to 4000"),
    ("nominal_mm_s = 100", "nominal_mm_s = 1e300", r"nominal_mm_s must be from 0\.001 to 4000"),
    ("nominal_mm_s = 100\n", "", r"nominal_mm_s is missing: add nominal_mm_s = a number"),
    ("ramp_time_s = 0.1", "ramp_time_s = 0", r"ramp_time_s must be from 0\.002 to 1000"),
    ("n_c = 5", 'n_c = "optimize"', r'n_c cannot be "optimize"; did you mean "optimise"\?'),
    ("n_c = 5", "n_c = []", r"n_c must be a number"),
    ("n_c = 5", "n_c = 1" + 400 * "0", r"n_c must be a finite number"),
    ("[12, 18]", "[1" + 400 * "0" + ", 18]", r"point 1 holds 10+\.\.\.: give two finite numbers"),
    ("n_c = 5", "degree = 5.5", r"degree must be a whole number"),
    ('policy = "report"', 'policy = "ignore"', r'policy cannot be "ignore"'),
    ("jerk_mm_s3 = 5e4", "jerk_mm_s3 = 0", r"jerk_mm_s3 must be from 0\.1"),
    ("[limits]", "[machine]\nfile = 3\n[limits]", r"\[machine\] file must be a text"),
    ("[limits]", "feed = 3\n[limits]", r"unknown key"),
]


@pytest.mark.parametrize(("old", "new", "message"), MISTAKES, ids=[m[2] for m in MISTAKES])
def test_mistakes(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in GOOD
    file = write(tmp_path, GOOD.replace(old, new, 1))
    with pytest.raises(InputError) as caught:
        load_path_file(file)
    text = str(caught.value)
    assert re.search(message, text), text
    assert text.startswith(f"{file}: ")
    assert "\n" not in text


MORE_MISTAKES = [
    ("volts = 4.5", "volts = 0", r"\[limits\] volts must be from 0\.001"),
    ("volts = 4.5", "volt = 4.5", r'\[limits\] volt: unknown key; did you mean "volts"\?'),
    ("[5e4, 4e4]", "[5e4]", r"\[limits\.axis\] jerk_mm_s3 must be two numbers \[a, b\]"),
    ("[5e4, 4e4]", "[5e4, 0]", r"\[limits\.axis\] jerk_mm_s3 must be from 0\.1"),
    ("[5e4, 4e4]", "'5e4'", r"\[limits\.axis\] jerk_mm_s3 must be a number"),
    ("to_mm = 12.5\n", "", r"\[limits\.cap 1\] to_mm is missing"),
    ("to_mm = 20", "to_mm = 10", r"\[limits\.cap 2\] from_mm is 10: must be below to_mm = 10"),
    ("from_mm = 10", "from_mm = -1", r"\[limits\.cap 2\] from_mm must be from 0"),
    (
        "feed_mm_s = 50",
        "feed = 50",
        r'\[limits\.cap 2\] feed: unknown key; did you mean "feed_mm_s"',
    ),
    ("volts = 4.5", "cap = 4.5", r"not valid TOML"),
    ("volts = 4.5", "reserve = 0", r"\[limits\] reserve must be from 0\.002 to 0\.9"),
]


@pytest.mark.parametrize(("old", "new", "message"), MORE_MISTAKES)
def test_mistakes_in_limits(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in FULL
    file = write(tmp_path, FULL.replace(old, new, 1))
    with pytest.raises(InputError, match=message) as caught:
        load_path_file(file)
    assert str(caught.value).startswith(f"{file}: ")
    assert "\n" not in str(caught.value)


def test_a_cap_that_is_no_section(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"needs one section \[\[limits\.cap\]\] or more"):
        load_path_file(write(tmp_path, GOOD + "cap = 3\n"))


def test_sections_that_are_no_sections(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\[path\] must be a section, but is 3"):
        load_path_file(write(tmp_path, "path = 3\n"))
    with pytest.raises(InputError, match=r"the section \[path\] is missing"):
        load_path_file(write(tmp_path, ""))


def test_unreadable_files(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        load_path_file(tmp_path / "none.toml")
    with pytest.raises(InputError, match="is a directory"):
        load_path_file(tmp_path)
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="not UTF-8"):
        load_path_file(binary)
    deep = tmp_path / "deep.toml"
    deep.write_text("a = " + "[" * 20000)
    with pytest.raises(InputError, match="not valid TOML"):
        load_path_file(deep)


def test_only_a_path(tmp_path: Path) -> None:
    """`hodograph spline` needs neither a feed nor a machine that is there."""
    text = "[path]\nclosed = true\nthrough = [[0,0],[1,0],[1,1]]\n[machine]\nfile = 'no.toml'\n"
    found = load_path_file(write(tmp_path, text))
    assert found.feed is None
    assert found.machine_file == tmp_path / "no.toml"


SPACE = "[path]\nclosed = false\nthrough = [[0, 0, 1], [9, 1, 2.5], [12, 8, 0]]\n"


def test_a_path_in_space(tmp_path: Path) -> None:
    text = SPACE + 'start_tangent = [0, 0, -1]\nknots = "centripetal"\n'
    found = load_path_file(write(tmp_path, text))
    path = found.given_path
    np.testing.assert_array_equal(path.points, [[0, 0, 1], [9, 1, 2.5], [12, 8, 0]])
    np.testing.assert_array_equal(path.start_tangent, [0, 0, -1])
    assert path.end_tangent is None
    assert path.knots == "centripetal"
    with pytest.raises(
        PlanError, match=r"points \[x, y, z\]: this command takes a path in the plane"
    ):
        found.require_planar()


def test_knots_are_chord_lengths_unless_said(tmp_path: Path) -> None:
    assert load_path_file(write(tmp_path, SPACE)).given_path.knots == "chord"
    flat = "[path]\nclosed = true\nthrough = [[0,0],[9,1],[12,8]]\n"
    assert load_path_file(write(tmp_path, flat)).path.knots == "chord"
    uniform = load_path_file(write(tmp_path, flat + 'knots = "uniform"\n'))
    assert uniform.path.knots == "uniform"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[9, 1, 2.5]", "[9, 1]", r"point 1 must be \[x, y, z\] like the first, but is \[9, 1\]"),
        ("[9, 1, 2.5]", "[9, 1, inf]", r"point 1 holds inf: give three finite numbers"),
        ("[9, 1, 2.5]", "[9, 1, 5000]", r"point 1 holds 5000: at most 4096 mm from 0"),
        ("[0, 0, 1]", "[0, 0, 1, 2]", r"point 1 must be \[x, y, z, a\] like the first"),
        ("[0, 0, 1]", "[0, 0, 1, 2, 3, 4, 5]", r"point 0 has 7 numbers: at most 6"),
        ("false", "false\nstart_tangent = [0, 1]", r"start_tangent must be three numbers"),
        ("false", "false\nend_tangent = [0, 0, 0]", r"end_tangent must not be \[0, 0, 0\]"),
        ("false", "false\nknots = 'even'", r'knots cannot be "even"; use one of: chord'),
        ("through", "knots = 'chord'\ncontrol_points", r"knots applies to through points only"),
    ],
)
def test_mistakes_in_space(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in SPACE
    with pytest.raises(InputError, match=message):
        load_path_file(write(tmp_path, SPACE.replace(old, new, 1)))


ROUND = [[0, 0], [9, 1], [12, 8], [5, 12], [-3, 7]]


@pytest.mark.parametrize(
    ("key", "tail"),
    [
        ("through", [[0.001, 0]]),
        ("control_points", [[0, 0.002]]),
        ("control_points", [[0, 0], [9, 1], [12.5, 8]]),
        ("control_points", [[0, 0], [9, 3], [12, 8]]),
        ("control_points", [[0.001, 0], [9, 1], [12, 8]]),
    ],
)
def test_a_closed_path_whose_end_does_not_match(
    tmp_path: Path, key: str, tail: list[list[float]]
) -> None:
    text = f"[path]\nclosed = true\n{key} = {ROUND + tail}\n"
    with pytest.raises(InputError, match=r"path\.toml: \[path\] \w+ do not close: point \d is"):
        load_path_file(write(tmp_path, text))


@pytest.mark.parametrize(
    ("key", "tail"),
    [
        ("through", [[0, 0]]),
        ("through", [[0.1, 0]]),
        ("control_points", [[0, 0], [9, 1], [12, 8]]),
        ("control_points", [[0, 0], [9, -5], [20, 8]]),
    ],
)
def test_a_closed_path_that_comes_back(tmp_path: Path, key: str, tail: list[list[float]]) -> None:
    """Repeated exactly, or passing the same place once more: both are meant."""
    text = f"[path]\nclosed = true\n{key} = {ROUND + tail}\n"
    assert load_path_file(write(tmp_path, text)).path.points.size == len(ROUND + tail)


def test_a_machine_file_of_a_name_that_no_file_can_have(tmp_path: Path) -> None:
    text = GOOD + f'[machine]\nfile = "{"m" * 500}"\n'
    with pytest.raises(InputError, match="which is not there"):
        load_pipeline(write(tmp_path, text)).program  # noqa: B018
