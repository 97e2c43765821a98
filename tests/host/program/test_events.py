# SPDX-License-Identifier: MIT
"""Events of a program: bytes, both checks, names in machine and path files, and what a simulated run makes of them. Run
by pytest; writes to temporary folders.
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hodograph.config import load_machine, load_path_file
from hodograph.errors import InputError, PlanError
from hodograph.events import ANALOGUE, DIGITAL, EVENT, PROPORTIONAL, Event, events_of
from hodograph.native import ROW, NativeProgram, OfflineSimulation
from hodograph.native.offline import OfflineOrder
from hodograph.pipeline import Pipeline, load_pipeline
from hodograph.program import decode, encode, inspect_dict, inspect_text
from hodograph.program.check import check_image
from hodograph.program.image import with_crc
from hodograph.simulate import simulate_on, write_trace

pytestmark = pytest.mark.usefixtures("stops_planned_once")

ROOT = Path(__file__).parents[3]
BASE = (ROOT / "tests" / "data" / "programs" / "alpha_events.hdgp").read_bytes()
MACHINE = ROOT / "examples" / "machines" / "dispenser.toml"
MM = 1 << 40

PATH = """
[path]
closed = false
through = [[0, 0], [20, 0], [40, 2], [52, 12]]

[feed]
nominal_mm_s = 60
ramp_time_s = 0.1
n_c = 5

[machine]
file = "{machine}"
"""


def path_file(tmp_path: Path, outputs: str, machine: Path = MACHINE) -> Path:
    file = tmp_path / "path.toml"
    file.write_text(PATH.format(machine=machine) + outputs)
    return file


def output(**keys: object) -> str:
    lines = [f"{key} = {json.dumps(value)}" for key, value in keys.items()]
    return "\n[[output]]\n" + "\n".join(lines) + "\n"


def test_bytes_come_back() -> None:
    program = decode(BASE)
    assert program.events.tolist() == [
        (0, DIGITAL, 0, 0x8001, 1),
        (20 * MM, ANALOGUE, 0, 0, -1000),
        (20 * MM + 1, PROPORTIONAL, 2, 0, 65536),
    ]
    assert encode(program) == BASE
    bare = encode(replace(program, events=events_of([])))
    assert len(BASE) == len(bare) + 48
    assert bare[128:] == BASE[128 : len(bare)]
    assert NativeProgram(BASE).events.tolist() == program.events.tolist()
    assert inspect_dict(program)["events"][1] == {
        "place_mm": 20.0,
        "kind": "analogue",
        "channel": 0,
        "mask": 0,
        "value": -1000,
    }
    assert "20.000000000" in inspect_text(program)


def test_mutated_tables_get_the_same_verdict_from_both_checks() -> None:
    rng = np.random.default_rng(5)
    first = len(BASE) - 48
    codes = set()
    for _ in range(300):
        changed = bytearray(BASE)
        for at in rng.integers(first, len(BASE), rng.integers(1, 3)):
            changed[at] = rng.choice((0, 1, 2, 3, 4, 127, 128, 255))
        image = with_crc(bytes(changed))
        own, native = check_image(image), NativeProgram(image).check()
        assert (own and (own.code, own.index)) == (native and (native.code, native.index))
        codes.add(own.code.name if own else "OK")
    assert codes == {"OK", "EVENT_KIND", "EVENT_VALUE", "EVENT_PLACE"}


def test_dense_events_are_refused_alike() -> None:
    program = decode(BASE)
    for apart_q40 in (MM // 200, MM // 100, MM // 50):
        rows = [Event(20 * MM + i * apart_q40, DIGITAL, 0, 1, i & 1) for i in range(40)]
        image = encode(replace(program, events=events_of(rows)))
        own, native = check_image(image), NativeProgram(image).check()
        assert (own and (own.code, own.index)) == (native and (native.code, native.index))
    assert own is None


def test_places_of_a_path_file(tmp_path: Path) -> None:
    outputs = (
        output(name="valve", at_point=2, on=True)
        + output(name="needle", at_fraction=1.0, on=False)
        + output(name="power", at_mm=0.5, value=50)
        + output(name="power", at_mm=0.5, per_mm_s=0.25)
    )
    pipeline = load_pipeline(path_file(tmp_path, outputs))
    starts = pipeline.curve.segment_starts_mm
    assert pipeline.program.events.tolist() == [
        (MM // 2, ANALOGUE, 0, 0, 16384),
        (MM // 2, PROPORTIONAL, 0, 0, round(0.25 * 327.67 * 65536)),
        (round(starts[2] * MM), DIGITAL, 0, 1, 1),
        (pipeline.program.length_q40, DIGITAL, 0, 2, 0),
    ]
    assert pipeline.accepted.check() is None


@pytest.mark.parametrize("beyond_mm", [0.0, 0.9e-6])
def test_a_place_at_the_end_as_typed(tmp_path: Path, beyond_mm: float) -> None:
    """A straight of 12 mm whose computed length is less by rounding."""
    file = path_file(tmp_path, output(name="valve", at_mm=12 + beyond_mm, on=True))
    points = "[[0, 0], [20, 0], [40, 2], [52, 12]]"
    text = file.read_text()
    assert points in text
    file.write_text(text.replace(points, "[[0, 0], [4, 0], [12, 0]]"))
    pipeline = load_pipeline(file)
    assert pipeline.curve.length_mm < 12.0
    assert pipeline.program.events["place"].tolist() == [pipeline.program.length_q40]
    assert pipeline.accepted.check() is None


def test_without_outputs_the_image_is_that_of_before(tmp_path: Path) -> None:
    file = path_file(tmp_path, "")
    assert load_pipeline(file).image[76:80] == bytes(4)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"name": "valve", "at_mm": 1.0}, "give one of on, value, per_mm_s, not none"),
        ({"name": "valve", "on": True}, "give one of at_mm, at_point, at_fraction, not none"),
        (
            {"name": "valve", "on": True, "at_mm": 1, "at_point": 1},
            "at_mm and at_point",
        ),
        ({"name": "vale", "on": True, "at_mm": 1}, 'no output "vale"; it has valve'),
        ({"name": "valve", "value": 1, "at_mm": 1}, "valve is digital: give on"),
        ({"name": "power", "on": True, "at_mm": 1}, "power is analogue: give value"),
        ({"name": "power", "value": 101, "at_mm": 1}, "outside of -32768 … 32767"),
        ({"name": "power", "per_mm_s": 1e6, "at_mm": 1}, "above what a program holds"),
        ({"name": "valve", "on": True, "at_mm": 1000}, "beyond the end of the path"),
        ({"name": "valve", "on": True, "at_point": 4}, "from 0 to 3"),
        ({"name": "valve", "on": True, "at": 4}, "unknown key"),
    ],
)
def test_mistakes_of_a_path_file(tmp_path: Path, keys: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        _ = load_pipeline(path_file(tmp_path, output(**keys))).image


def test_too_many_outputs_at_a_place(tmp_path: Path) -> None:
    outputs = "".join(output(name="valve", at_mm=30, on=bool(i % 2)) for i in range(17))
    with pytest.raises(PlanError, match=r"more than 16 events .*event 16"):
        _ = load_pipeline(path_file(tmp_path, outputs)).image


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("node = 16", "node = 2", "which the controller or a drive has"),
        ("digital = 1 }", "digital = 0 }", "is the same output as valve"),
        ("digital = 1 }", "digital = 16 }", "from 0 to 15"),
        ("analogue = 0,", "analogue = 3,", "from 0 to 2"),
        ("digital = 1 }", "digital = 1, scale = 2.0 }", "analogue outputs only"),
        ("digital = 1 }", "digital = 1, analogue = 1 }", "must be { digital = 0 } or"),
        ("scale = 327.67", "scale = 0", "must not be 0"),
        ("delay_ticks = 1", "delay_ticks = 9", "from 0 to 8"),
        ("needle =", '"2d" =', "no name for an output"),
    ],
)
def test_mistakes_of_a_machine_file(tmp_path: Path, old: str, new: str, words: str) -> None:
    text = MACHINE.read_text().replace("../drives", str(MACHINE.parents[1] / "drives"))
    assert old in text
    file = tmp_path / "machine.toml"
    file.write_text(text.replace(old, new))
    with pytest.raises(InputError, match=words):
        load_machine(file)


def test_a_machine_without_outputs(tmp_path: Path) -> None:
    machine = ROOT / "examples" / "machines" / "tuned.toml"
    file = path_file(tmp_path, output(name="valve", at_mm=1, on=True), machine)
    with pytest.raises(InputError, match="has no outputs: add"):
        _ = Pipeline(load_path_file(file)).image


def test_a_run_acts_at_the_first_setpoint_past_the_place(tmp_path: Path) -> None:
    outputs = (
        output(name="needle", at_mm=0, on=True)
        + output(name="valve", at_mm=20.0, on=True)
        + output(name="power", at_mm=20.0, per_mm_s=0.5)
        + output(name="valve", at_fraction=1.0, on=False)
    )
    pipeline = load_pipeline(path_file(tmp_path, outputs))
    motion = simulate_on(pipeline.machine, pipeline.image)
    valve = motion.output_columns["valve"][: motion.ticks]
    power = motion.output_columns["power"][: motion.ticks]
    there = motion.arc_length_mm[: motion.ticks] >= 20.0
    assert np.array_equal(valve[:-1], there[:-1])
    assert valve[-1] == 0
    expected = np.where(there, 0.5 * motion.feed_mm_s[: motion.ticks], 0.0)
    assert np.abs(power - expected).max() <= 0.5 / 327.67 + 1e-9
    acted = motion.summary()["outputs"]
    assert [one["name"] for one in acted] == ["needle", "valve", "power", "valve"]
    assert acted[1]["tick"] == int(there.argmax())
    assert acted[2] == acted[1] | {
        "name": "power",
        "value": None,
        "per_mm_s": pytest.approx(0.5, abs=1e-7),
    }
    assert acted[3]["tick"] == motion.ticks - 1
    quick = simulate_on(pipeline.machine, pipeline.image, keep_rows=False)
    assert quick.summary() == motion.summary()
    trace = tmp_path / "trace.csv"
    write_trace(motion, trace)
    lines = trace.read_text().splitlines()
    assert lines[0].endswith(",valve_out,needle_out,laser_out,power_out")
    assert lines[1].endswith(",0,1,0,0.0")


@pytest.mark.parametrize("percent", [50, 200])
@pytest.mark.parametrize("hold", [0, 5, 200, 340, 341, 600])
def test_override_and_holds_keep_the_place(tmp_path: Path, percent: int, hold: int) -> None:
    pipeline = load_pipeline(path_file(tmp_path, output(name="valve", at_mm=20.0, on=True)))
    program = NativeProgram(pipeline.image)
    program.require()
    machine = pipeline.machine
    orders = [
        OfflineOrder("override", 1, percent),
        OfflineOrder("hold", 2 + hold),
        OfflineOrder("resume", 602 + hold),
    ]
    simulation = OfflineSimulation(
        program, "fixed", machine.models(machine.path_axes), 1_000_000, None, (), orders
    )
    rows = np.zeros(4 * program.ticks + 1000, dtype=ROW)
    simulation.run(rows)
    assert np.array_equal(rows["digital"], rows["arc_length_q40_mm"] >= 20 * MM)
    assert rows["digital"][-1] == 1


@pytest.fixture(scope="module")
def space(tmp_path_factory: pytest.TempPathFactory) -> Pipeline:
    """Five axes, an event at the start, one at the end, and one exactly where a setpoint lies."""
    folder = tmp_path_factory.mktemp("space")
    outputs = MACHINE.read_text().partition("[outputs]")[2].partition("[[axis]]")[0]
    text = (ROOT / "examples" / "machines" / "mill_five_axes.toml").read_text()
    text = text.replace("../drives", f"{ROOT}/examples/drives")
    machine = folder / "five.toml"
    machine.write_text(text.replace("[[axis]]", f"[outputs]{outputs}[[axis]]", 1))
    points = "[[0, 0, 0, 0, 0], [10, 3, 1, 5, 10], [20, 0, 0, 10, 0]]"
    head = (
        f"[path]\nclosed = false\nthrough = {points}\n[feed]\nprofile = 'optimal'\nnominal_mm_s = 50\n"
        f"[limits]\nreserve = 0.3\naxis.velocity_mm_s = [100, 100, 100, 90, 90]\n[machine]\nfile = '{machine}'\n"
    )
    file = folder / "path.toml"
    file.write_text(head)
    plain = load_pipeline(file, allow_space=True)
    ticks = simulate_on(plain.machine, plain.image).arc_length_mm
    file.write_text(
        head
        + output(name="needle", at_mm=0.0, on=True)
        + output(name="valve", at_mm=float(ticks[ticks.size // 3]), on=True)
        + output(name="needle", at_fraction=1.0, on=False)
    )
    return load_pipeline(file, allow_space=True)


NEEDLE, VALVE = 1 << 1, 1 << 0


@pytest.mark.parametrize("ahead", [-1, 0, 1, 2, 3])
@pytest.mark.parametrize("stop", ["hold", "override"])
def test_holds_and_an_override_of_0_beside_an_event(space: Pipeline, stop: str, ahead: int) -> None:
    """The command comes so many ticks before the setpoint that is exactly at the event."""
    program = NativeProgram(space.image)
    program.require()
    events = space.program.events
    place, end = (int(events["place"][k]) for k in (1, 2))
    assert (int(events["place"][0]), end) == (0, space.program.length_q40)
    machine = space.machine
    models, counts = machine.models(machine.path_axes), machine.path_counts

    def moved(orders: list[OfflineOrder]) -> np.ndarray:
        simulation = OfflineSimulation(program, "fixed", models, counts, None, (), orders)
        rows = np.zeros(3 * program.ticks + 2000, dtype=ROW)
        simulation.run(rows)
        return rows

    straight = moved([])
    at = int((straight["arc_length_q40_mm"] >= place).argmax())
    assert straight["arc_length_q40_mm"][at] == place, "the event lies at a setpoint"
    begin, continues = at - ahead, at - ahead + 1000
    if stop == "hold":
        orders = [OfflineOrder("hold", begin), OfflineOrder("resume", continues)]
    else:
        orders = [OfflineOrder("override", begin, 0), OfflineOrder("override", continues, 100)]
    rows = moved(orders)
    arc = rows["arc_length_q40_mm"]
    assert arc[begin + 990] == arc[begin + 980] < end, "at rest"
    assert np.array_equal((rows["digital"] & VALVE) != 0, arc >= place)
    assert np.array_equal((rows["digital"] & NEEDLE) != 0, arc < end)
    assert arc[-1] == end


@pytest.mark.parametrize("kind", ["stop", "fault-stop"])
def test_a_stop_switches_off(tmp_path: Path, kind: str) -> None:
    outputs = output(name="needle", at_mm=0, on=True) + output(name="valve", at_mm=21, on=True)
    pipeline = load_pipeline(path_file(tmp_path, outputs))
    program = NativeProgram(pipeline.image)
    program.require()
    machine = pipeline.machine
    orders = [OfflineOrder(kind, 350)]
    simulation = OfflineSimulation(
        program, "fixed", machine.models(machine.path_axes), 1_000_000, None, (), orders
    )
    rows = np.zeros(800, dtype=ROW)
    simulation.run(rows)
    assert np.array_equal(np.flatnonzero(rows["digital"]), np.arange(350))


def test_python_and_c_have_the_same_record() -> None:
    assert EVENT.itemsize == 16
    program = NativeProgram(BASE)
    arc = np.arange(0, 30 * MM, MM // 8)
    feed = np.full(arc.shape, 3 << 32)
    digital, analogue = program.outputs(arc, feed)
    assert set(digital.tolist()) == {1}
    assert np.array_equal(analogue[:, 0], np.where(arc >= 20 * MM, -1000, 0))
    assert np.array_equal(analogue[:, 2], np.where(arc > 20 * MM, 3, 0))
