# SPDX-License-Identifier: MIT
"""A path whose fault stops would come too late is planned again, and refused only where no plan helps. Run by pytest;
writes to temporary folders.
"""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hodograph import section_pipeline
from hodograph.cli.main import main
from hodograph.config import load_machine, load_path_file
from hodograph.errors import PlanError
from hodograph.feed import Limits
from hodograph.feed.request import LEAST_FEED_MM_S
from hodograph.job import load_job
from hodograph.pipeline import Pipeline, load_pipeline
from hodograph.program import Program, stop_reserve
from hodograph.program.compiler import Compilation
from hodograph.program.late_stops import MOST_STEPS, Replanning
from hodograph.program.stop_planning import LongStopError
from hodograph.program.stop_reserve import StopPlaces, zones_at_places
from hodograph.program.stops import FAULT
from hodograph.section_pipeline import SectionPipeline
from marks import long

pytestmark = pytest.mark.usefixtures("stops_planned_once")

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
FIVE_AXES = EXAMPLES / "machines/mill_five_axes.toml"
OPTIMAL = 'profile = "optimal"\n'
MINIMAX = 'profile = "minimax"\nnominal_mm_s = 60\nramp_time_s = 0.06\n'


def five_axes_file(folder: Path, seed: int, feed: str, limits: str = "") -> Path:
    """A short path of three to eight points; a and c turn by up to 12 degrees from one to the next."""
    rng = np.random.default_rng([seed, 77])
    count = int(rng.integers(3, 9))
    legs = rng.uniform(1.0, 10.0, (count, 1))
    along = np.cumsum(rng.uniform(-0.9, 0.9, (count, 3)), axis=0) + np.array([1.0, 0.0, 0.0])
    drawn = np.cumsum(legs * along / np.linalg.norm(along, axis=1)[:, None], axis=0)
    turned = np.cumsum(rng.uniform(-12, 12, (count, 2)), axis=0)
    points = np.concatenate((drawn, turned), axis=1).round(4).tolist()
    file = folder / f"five{seed}.toml"
    file.write_text(
        f'[path]\nclosed = false\nthrough = {points}\n[feed]\n{feed}{limits}[machine]\nfile = "{FIVE_AXES}"\n',
        encoding="utf-8",
    )
    return file


def on_machine(name: str, stop_time_ms: int, **limits: str) -> Pipeline:
    file = load_path_file(EXAMPLES / f"{name}.toml")
    assert file.machine_file is not None
    machine = replace(load_machine(file.machine_file), stop_time_ms=stop_time_ms)
    return Pipeline(replace(file, limits=replace(file.limits, **limits)), machine)


@pytest.mark.parametrize("seed", [4, long(10)])
def test_a_short_path_of_five_axes_is_planned_again(tmp_path: Path, seed: int) -> None:
    made = load_pipeline(five_axes_file(tmp_path, seed, OPTIMAL), allow_space=True)
    program = made.program
    assert made.accepted.check() is None
    assert program.stops.worst(FAULT).time_s <= 0.25
    assert made.plan.duration_s < program.duration_s < 1.25 * made.plan.duration_s
    assert "planned again with more room for stops" in made.compilation.notes[-1]
    assert "stop_time_ms = 250" in made.compilation.notes[-1]


def test_a_plan_that_is_in_time_is_not_planned_again(tmp_path: Path) -> None:
    made = load_pipeline(five_axes_file(tmp_path, 3, OPTIMAL), allow_space=True)
    assert made.compilation.plan is made.plan


def test_stops_are_found_where_axes_turn_by_many_degrees_within_a_millimetre(
    tmp_path: Path,
) -> None:
    """Such a place needs codes far below those that the limits along the path allow."""
    made = load_pipeline(five_axes_file(tmp_path, 6, MINIMAX), allow_space=True)
    assert made.program.stops.worst(FAULT).time_s <= 0.25
    assert made.compilation.plan is made.plan


@pytest.mark.parametrize("policy", ["respect", "report"])
@pytest.mark.parametrize(("name", "stop_time_ms"), [("alpha", 60), ("alpha_optimal", 60)])
def test_the_feed_is_lowered_where_room_is_not_enough(
    name: str, stop_time_ms: int, policy: str
) -> None:
    made = on_machine(name, stop_time_ms, policy=policy)
    assert made.program.stops.worst(FAULT).time_s <= stop_time_ms * 1e-3
    assert made.accepted.check() is None
    assert made.compilation.plan.feed_mm_s < made.plan.feed_mm_s
    (note,) = (line for line in made.compilation.notes if "stop_time_ms = 60" in line)
    assert note.startswith(("feed lowered from", "feed capped:"))


def test_where_no_plan_helps_the_refusal_has_the_place_and_what_to_do() -> None:
    made = on_machine("alpha", 3)
    with pytest.raises(PlanError) as refused:
        _ = made.program
    text = str(refused.value)
    assert "fault stop at arc length 34.9805 mm" in text
    assert "stop_time_ms = 3" in text
    assert "no plan was found" in text
    assert "raise stop_time_ms" in text


def corner(folder: Path, stop_time_ms: int) -> SectionPipeline:
    """A toolpath around one corner, planned for least time."""
    file = folder / "corner.ngc"
    file.write_text("G21 F6000\nG1 X20 Y0\nG1 X20 Y8\nM2\n", encoding="utf-8")
    mill = load_machine(EXAMPLES / "machines/mill.toml")
    return load_job(file, replace(mill, stop_time_ms=stop_time_ms)).only_section("test").pipeline


@pytest.mark.parametrize("stop_time_ms", [long(100), 60])
def test_a_section_of_a_toolpath_is_planned_with_less_feed(
    tmp_path: Path, stop_time_ms: int
) -> None:
    made = corner(tmp_path, stop_time_ms)
    assert made.program.stops.worst(FAULT).time_s <= stop_time_ms * 1e-3
    assert made.accepted.check() is None
    (note,) = made.compilation.notes
    assert note.startswith("feed capped: a fault stop at arc length 5.88")
    assert made.compilation.plan.feed_mm_s < 0.5 * made.plan.feed_mm_s


def test_an_optimal_plan_that_no_plan_helps_is_refused(tmp_path: Path) -> None:
    made = corner(tmp_path, 2)
    with pytest.raises(PlanError, match=r"corner.ngc:2: stops: .*, and no plan was found") as found:
        _ = made.program
    assert str(found.value).count("corner.ngc") == 1
    assert not isinstance(found.value, LongStopError)


def test_only_what_was_planned_again_is_said_to_be(tmp_path: Path) -> None:
    """Direct callers, such as `goto`, plan once."""
    program = corner(tmp_path, 500).program
    assert str(LongStopError(program, 3)).startswith("stops: a fault stop at arc length ")
    assert "no plan was found" not in str(LongStopError(program, 3))
    assert "lower the feed there, or raise stop_time_ms" in str(LongStopError(program, 3))


class Attempts:
    """The callables of a pipeline, of which one fails at first with another refusal than a late stop."""

    def __init__(self, made: Pipeline, fails: str, times: int = 1) -> None:
        self.made, self.fails, self.left = made, fails, times
        self.calls: list[str] = []
        self.late_in_excerpt: Callable[[Limits, Program], bool] = lambda limits, late: False

    def of(self, name: str) -> object:
        """A callable of the pipeline."""
        own = {
            "plan": self.made._planned,
            "slower": self.made._slower,
            "compile": self.made._compiled_again,
            "search": self.made._searched,
        }[name]

        def called(*given: object) -> object:
            self.calls.append(name)
            if name == self.fails and self.left:
                self.left -= 1
                raise PlanError("program: no headroom")
            return own(*given)

        return called

    def in_time(self, stop_time_ms: int) -> Compilation:
        """The program of a plan made again."""
        plan = self.made.plan
        with pytest.raises(LongStopError) as late:
            self.made._with_stops(plan, self.made.stop_terms)
        each = [self.of(name) for name in ("plan", "slower", "compile", "search")]
        again = Replanning(*each, stop_time_ms * 1e-3, self.late_in_excerpt)
        return again.in_time(plan, late.value)


@pytest.mark.parametrize("fails", ["plan", "search", "compile"])
def test_a_reserve_of_which_no_program_can_be_made_is_passed_over(
    tmp_path: Path, fails: str
) -> None:
    attempts = Attempts(corner(tmp_path, 120), fails)
    found = attempts.in_time(120)
    assert found.program.stops.worst(FAULT).time_s <= 0.12
    assert "planned again with more room" in found.notes[-1]
    assert "slower" not in attempts.calls


def test_a_plan_with_late_stops_in_an_excerpt_is_not_made(tmp_path: Path) -> None:
    attempts = Attempts(corner(tmp_path, 120), "none")
    attempts.late_in_excerpt = lambda limits, late: jerk_of(limits) > 25000.0
    found = attempts.in_time(120)
    assert found.program.stops.worst(FAULT).time_s <= 0.12
    assert jerk_of(found.plan.limits) == 20000.0
    assert attempts.calls.count("search") == 1


def jerk_of(limits: Limits) -> float:
    """The limit of the jerk of the machine's first axis."""
    assert limits.machine.jerk_mm_s3 is not None
    return limits.machine.jerk_mm_s3[0]


def toolpath(folder: Path, *lines: str) -> SectionPipeline:
    """The only section of a toolpath."""
    file = folder / "path.ngc"
    file.write_text("\n".join(("G21 G91 F6000", *lines, "M2\n")), encoding="utf-8")
    mill = load_machine(EXAMPLES / "machines/mill.toml")
    return load_job(file, mill).only_section("test").pipeline


STAIRS = ("G1 X0.5", "G1 Y0.5") * 25


def with_brief_excerpts(patch: pytest.MonkeyPatch) -> None:
    """Excerpts that short stairs have too."""
    patch.setattr(section_pipeline, "_EXCERPT_STOPS", 3.0)
    patch.setattr(section_pipeline, "_LONG_EXCERPTS", 1.5)


def test_an_excerpt_shows_which_plan_is_useless(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Stops of long stairs are late with limits that are 16 % lower, not with 25 %."""
    whole = toolpath(tmp_path, *STAIRS).image
    with_brief_excerpts(monkeypatch)
    monkeypatch.setattr(section_pipeline, "_ALIKE", 1.5)  # the end of the whole has no late stops
    made = toolpath(tmp_path, *STAIRS)
    planned: list[tuple[float, float]] = []
    usual = SectionPipeline._planned

    def counted(self: SectionPipeline, limits: Limits) -> object:
        planned.append((self.curve.length_mm, jerk_of(limits)))
        return usual(self, limits)

    monkeypatch.setattr(SectionPipeline, "_planned", counted)
    assert made.image == whole
    shares = [round(jerk / planned[0][1], 2) for _, jerk in planned]
    excerpts = [length < made.curve.length_mm for length, _ in planned]
    assert shares == [1.0, 0.84, 0.75, 0.75, 1.0]
    assert excerpts == [False, True, True, False, False]


@pytest.mark.parametrize("stairs_first", [True, False])
def test_an_excerpt_is_like_the_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, stairs_first: bool
) -> None:
    """An excerpt in which stops are late more often than in the whole shows nothing."""
    with_brief_excerpts(monkeypatch)
    parts = [*STAIRS[:24], "G1 X150"]
    made = toolpath(tmp_path, *(parts if stairs_first else parts[::-1]))
    with pytest.raises(LongStopError) as late:
        made._with_stops(made.plan, made.stop_terms)
    excerpt = made._excerpt(late.value.program, 0.5)
    assert (excerpt is None) == stairs_first
    if excerpt is not None:
        assert 0.0 < excerpt.curve.length_mm < made.curve.length_mm


@pytest.mark.parametrize("fails", ["slower", "search", "compile"])
def test_a_feed_of_which_no_program_can_be_made_is_passed_over(fails: str) -> None:
    attempts = Attempts(on_machine("alpha", 72), fails)
    found = attempts.in_time(72)
    assert found.program.stops.worst(FAULT).time_s <= 0.072
    assert attempts.calls.count(fails) > 1


@pytest.mark.parametrize("name", ["alpha", "alpha_optimal"])
def test_where_all_attempts_fail_the_first_reason_is_said(name: str) -> None:
    attempts = Attempts(on_machine(name, 60), "search", 10**6)
    with pytest.raises(PlanError, match=r"fault stop at arc length .*, and no plan was found"):
        attempts.in_time(60)
    assert attempts.calls.count("slower") == MOST_STEPS


def test_the_feed_is_not_lowered_below_the_least_one() -> None:
    """A piece beside standstill has no feed zone below it, and keeps none of the others from one."""
    program = on_machine("alpha_optimal", 250).program
    pieces, chosen = program.pieces, np.ones(program.piece_count, dtype=np.bool_)
    mean = np.diff(np.append(pieces.start_q40, program.length_q40)) * 2.0**-40 / pieces.duration_s
    zones = pieces.slower_zones(chosen, 0.5, program.length_q40)
    assert len(zones) == np.count_nonzero(mean > LEAST_FEED_MM_S)
    assert [zone.feed_mm_s for zone in zones] == pytest.approx((0.5 * mean).tolist())
    zones = pieces.slower_zones(chosen, 1e-9, program.length_q40)
    assert {zone.feed_mm_s for zone in zones} == {LEAST_FEED_MM_S}
    duration_q32_s = pieces.duration_q32_s.copy()
    duration_q32_s[0] = 1 << 53
    still = replace(pieces, duration_q32_s=duration_q32_s)
    assert len(still.slower_zones(chosen, 0.5, program.length_q40)) == len(zones) - 1
    assert not still.slower_zones(np.arange(program.piece_count) == 0, 0.5, program.length_q40)
    none_left = replace(pieces, start_q40=np.full_like(pieces.start_q40, program.length_q40))
    assert not none_left.slower_zones(chosen, 0.5, program.length_q40)


def test_commands_say_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """`feed`, `compile` and `simulate` have the same motion, and the same note."""
    file = five_axes_file(tmp_path, 4, OPTIMAL)
    duration_s = load_pipeline(file, allow_space=True).program.duration_s
    words = {
        "feed": ["feed", str(file), "--json"],
        "compile": ["compile", str(file), "--json", "--output", str(tmp_path / "five.hdgp")],
        "simulate": ["simulate", str(file), "--json", "--fault-at", "0.2"],
    }
    for name, command in words.items():
        assert main(command) == 0
        out, err = capsys.readouterr()
        assert "planned again with more room for stops" in err, name
        found = json.loads(out)
        if name == "feed":
            assert found["duration_s"] == pytest.approx(duration_s, abs=1e-6)
        if name == "simulate":
            (stop,) = found["stops"]
            assert stop["rest_after_s"] <= stop["bound_s"] <= 0.25


def place(program: Program, begin_s: float, end_s: float, bound_s: float) -> StopPlaces:
    """One place, at a constant feed."""
    mm_s = program.length_q40 * 2.0**-40 / program.duration_s
    each = (begin_s, end_s, begin_s * mm_s, end_s * mm_s, bound_s)
    return StopPlaces(*(np.array([value]) for value in each))


def test_the_search_of_places_ends_where_stops_from_them_are_late(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """From a place whose stop is late the search goes on to an earlier one, not back to a later one."""
    program = on_machine("alpha", 250).program
    lowered = replace(program)
    places = {
        id(program): place(program, 0.5, 0.7, 0.05),
        id(lowered): place(program, 0.45, 0.46, 0.3),
    }
    monkeypatch.setattr(stop_reserve, "stop_places", lambda given: places[id(given)])
    assert len(zones_at_places(program, lowered, 0.1, 0.16, 1.0)) == 1
