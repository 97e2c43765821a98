# SPDX-License-Identifier: MIT
"""The JSON schemas of the input files agree with the readers: keys, ranges, words, required keys. Run by pytest; writes
to temporary folders.
"""

from __future__ import annotations

import copy
import json
import re
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft7Validator

from hodograph.campaign.definition import load_campaign
from hodograph.config import load_drive, load_machine, load_paths
from hodograph.errors import InputError
from hodograph.faults.scenario import load_scenario
from hodograph.schemas import NAMES, schema
from marks import long

ROOT = Path(__file__).resolve().parents[3]
EXAMPLES = ROOT / "examples"
READERS: dict[str, Callable[[Path], object]] = {
    "path": load_paths,
    "machine": load_machine,
    "drive": load_drive,
    "campaign": load_campaign,
    "scenario": load_scenario,
}
Document = dict[str, Any]
Way = tuple[str | int, ...]
"""Keys and indices from the root of a document to a value."""

AXIS: Document = {
    "name": "x",
    "unit": "mm",
    "node": 2,
    "travel_mm": [-200, 200],
    "velocity_mm_s": 400,
    "acceleration_mm_s2": 4000,
    "jerk_mm_s3": 150_000,
    "counts_per_mm": 1_000_000,
    "drive": str(EXAMPLES / "drives/alpha_x.toml"),
    "following_window_mm": 2,
    "following_timeout_ms": 20,
    "quick_stop_mm_s2": 3000,
    "homing": {
        "method": 17,
        "sequence": 2,
        "offset_mm": -100,
        "speed_mm_s": 20,
        "slow_mm_s": 2,
        "acceleration_mm_s2": 200,
    },
    "feedforward": {"velocity": 1, "torque_permille_s2_m": 12, "torque_permille_s_m": 3},
    "scaling": {
        "encoder_increments_per_rev": 131072,
        "feed_counts_per_rev": 10_000_000,
        "gear_motor_revolutions": 1,
        "gear_shaft_revolutions": 1,
    },
    "identity": {"vendor": 1, "product": 2, "revision": 3},
}
TURNING: Document = {
    "name": "a",
    "unit": "deg",
    "node": 5,
    "travel_deg": [-90, 90],
    "velocity_deg_s": 100,
    "acceleration_deg_s2": 1000,
    "jerk_deg_s3": 10_000,
    "counts_per_deg": 100_000,
    "drive": str(EXAMPLES / "drives/mill_rotary.toml"),
    "following_window_deg": 2,
    "quick_stop_deg_s2": 3000,
    "homing": {
        "method": 37,
        "offset_deg": 5,
        "speed_deg_s": 20,
        "slow_deg_s": 2,
        "acceleration_deg_s2": 200,
    },
    "feedforward": {"velocity": 1, "torque_permille_s2_kdeg": 12, "torque_permille_s_kdeg": 3},
}
SWITCHED = [
    {"name": "valve", "at_mm": 1.5, "on": True},
    {"name": "power", "at_point": 1, "value": 50},
    {"name": "power", "at_fraction": 0.5, "per_mm_s": 0.1},
]
ZONE = {"from_mm": 1, "to_mm": 2, "feed_mm_s": 10}
MACHINE: Document = {
    "path": ["x", "y"],
    "bus": {"bitrate": 1_000_000, "period_us": 2000},
    "controller": {
        "node": 1,
        "kernel": "fixed",
        "feed_mm_s": 500,
        "acceleration_mm_s2": 5000,
        "jerk_mm_s3": 200_000,
        "reserve": 0.1,
        "stop_time_ms": 250,
        "start_tolerance_mm": 0.01,
        "program_bytes": 129_008,
    },
    "supervision": {"answer_wait_ms": 2, "missed_max": 1, "setpoint_timeout_ms": 50},
    "work": {"offset_mm": [1, 2], "start_mm": [3, 4]},
    "outputs": {
        "node": 16,
        "delay_ticks": 2,
        "keep_at_stop": True,
        "keep_at_fault": True,
        "off_at_end": True,
        "off_in_hold": True,
        "vendor": 1,
        "product": 2,
        "channel": {
            "valve": {"digital": 0},
            "power": {"analogue": 0, "scale": 2.5, "unit": "%"},
        },
        "gcode": {
            "spindle": "valve",
            "spindle_reverse": "valve",
            "speed": "power",
            "mist": "valve",
            "flood": "valve",
            "laser_mode": False,
            "spindle_wait_s": 4.0,
        },
    },
    "axis": [AXIS, AXIS | {"name": "y", "node": 3}, TURNING],
}
CHANNELS = ("outputs", "channel")

FEED: Document = {
    "profile": "exponential",
    "nominal_mm_s": 50,
    "ramp_time_s": 0.1,
    "n_c": 4,
    "degree": 5,
}
LIMITS: Document = {
    "feed_mm_s": 100,
    "acceleration_mm_s2": 1000,
    "jerk_mm_s3": 10_000,
    "centripetal_mm_s2": 500,
    "volts": 5,
    "policy": "report",
    "reserve": 0.1,
    "axis": {
        "velocity_mm_s": 90,
        "acceleration_mm_s2": [900, 800],
        "jerk_mm_s3": 9000,
    },
    "cap": [ZONE],
}
TURN_FEED: Document = {"profile": "exponential", "nominal_deg_s": 50, "ramp_time_s": 0.1}
TURN_LIMITS: Document = {
    "feed_deg_s": 100,
    "acceleration_deg_s2": 1000,
    "jerk_deg_s3": 10_000,
}
TURN: Document = {"closed": False, "through": [[1, 2, 3, 0, 0], [1, 2, 3, 30, 40]]}
COMPLETE: dict[str, list[Document]] = {
    "path": [
        {
            "path": [
                {
                    "closed": False,
                    "through": [[0, 0], [10, 5], [20, 0]],
                    "knots": "uniform",
                    "start_tangent": [1, 1],
                    "end_tangent": [1, -1],
                    "feed": FEED,
                    "limits": LIMITS,
                },
                {
                    "closed": True,
                    "control_points": [[20, 0], [10, 10], [0, 20], [20, 20]],
                    "dwell_ms": 100,
                    "stop": "optional",
                },
                {
                    "closed": False,
                    "through": [[20, 0], [30, 5], [40, 0]],
                    "ends": "natural",
                    "output": SWITCHED,
                },
            ],
        },
        {
            "path": {
                "closed": False,
                "through": [[0, 0], [10, 5], [20, 0]],
                "knots": "uniform",
                "ends": "natural",
                "start_tangent": [1, 0],
                "end_tangent": [0, 1],
            },
            "feed": FEED,
            "limits": LIMITS,
            "machine": {"file": str(EXAMPLES / "machines/paper_alpha.toml")},
            "output": SWITCHED,
        },
        {
            "path": TURN,
            "feed": TURN_FEED,
            "limits": TURN_LIMITS,
        },
        {
            "path": [
                {
                    "closed": False,
                    "through": [[0, 2, 3, 0, 0], [1, 2, 3, 0, 0]],
                    "feed": FEED,
                },
                TURN | {"feed": TURN_FEED, "limits": TURN_LIMITS},
            ],
        },
        {
            "path": {"closed": True, "control_points": [[0, 0], [9, 0], [9, 9], [0, 9]]},
            "feed": {"profile": "optimal"},
        },
    ],
    "machine": [MACHINE],
    "drive": [
        {
            "plant": {
                "gain_rad_s_v": 80,
                "time_constant_s": 0.2,
                "screw_mm_rad": 1.6,
                "torque_to_volts": 1.4,
                "volts_limit": 5,
            },
            "pdff": {
                "k_pp_rad_s_mm": 300,
                "k_pv_nm_s_rad": 4,
                "k_iv_per_s": 500,
                "k_pf_rad_mm": 0.6,
                "k_vf": 1,
            },
            "encoder": {"counts_per_rev": 1024, "speed": "exact"},
            "servo": {"loop_rate_hz": 16000, "interpolation": "cubic", "delay_samples": 1},
            "equipment": {
                "limit_negative_mm": -10,
                "limit_positive_mm": 10,
                "home_from_mm": 1,
                "home_to_mm": 2,
                "rated_torque_nm": 1,
                "rated_current_a": 1,
                "overload_s": 1,
                "friction_volts": 0.1,
                "brake_volts": 1,
            },
        },
        {
            "plant": {
                "gain_rad_s_v": 80,
                "time_constant_s": 0.2,
                "screw_mm_rad": 1.6,
                "torque_to_volts": 1.4,
                "volts_limit": 5,
            },
            "pdff": {
                "k_pp_per_s": 300,
                "k_pv_nm_s_rad": 4,
                "k_iv_per_s": 500,
                "k_pf": 0.6,
                "k_vf": 1,
                "integral": "forward",
            },
        },
    ],
    "campaign": [
        {
            "text": "A title",
            "paths": [str(EXAMPLES / "alpha.toml")],
            "machine": str(EXAMPLES / "machines/paper_alpha.toml"),
            "kernel": "float",
            "profiles": ["quintic", "minimax"],
            "feeds_mm_s": [50, 100],
            "samples": 3,
            "seed": 7,
            "gains": [
                {
                    "name": "one",
                    "machine": str(EXAMPLES / "machines/tuned.toml"),
                    "k_pp_rad_s_mm": 100,
                    "k_pv_nm_s_rad": [1, 2],
                    "k_iv_per_s": 100,
                    "k_pf_rad_mm": 0.6,
                    "k_vf": 1,
                    "interpolation": "linear",
                    "feedforward": {
                        "velocity": 1,
                        "torque_permille_s2_m": [1, 2],
                        "torque_permille_s_m": 1,
                    },
                }
            ],
            "faults": [
                {"name": "none"},
                {
                    "name": "rules",
                    "rules": ["saturate node=2 at={at} for=10 volts=1"],
                    "random": {"at": [10, 20], "side": ["a", "b"]},
                },
                {"name": "file", "scenario": str(EXAMPLES / "faults/encoder-jumps-little.toml")},
            ],
            "vary": {
                "gain_rad_s_v": {"factor_uniform": [0.9, 1.1], "axis": "each"},
                "friction_volts": {"values": [0, 0.2], "axis": "all"},
            },
        }
    ],
    "scenario": [
        {
            "text": "A drive is silent",
            "path": "path.toml",
            "rules": ["drop at={at} id={tpdo1}"],
            "random": {"at": [20, 500], "node": [2, 3], "side": ["controller", "drives"]},
            "host": {"action": "none"},
            "expect": {
                "codes": [0x8250],
                "may": True,
                "within_ticks": 5,
                "within_ms": 300,
                "rest_ticks": 400,
                "rest_ms": 400,
                "same_encoders": False,
                "unseen": True,
                "recover_ms": 3000,
                "on_path": True,
            },
        }
    ],
}


VALIDATORS = {kind: Draft7Validator(schema(kind)) for kind in NAMES}


def valid(kind: str, document: Document) -> bool:
    """By the schema."""
    return VALIDATORS[kind].is_valid(document)


def inline(value: object) -> str:
    """TOML of a value in one line. (tomlkit keeps comments and order, and takes longer than all readers.)"""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(k)} = {inline(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(inline, value)) + "]"
    return repr(value) if isinstance(value, float) else json.dumps(value, ensure_ascii=False)


def refusal(kind: str, document: Document, folder: Path) -> str | None:
    """What the reader says of a document; None: it takes it."""
    file = folder / f"{kind}.toml"
    lines = [f"{json.dumps(key)} = {inline(value)}\n" for key, value in document.items()]
    file.write_text("".join(lines), encoding="utf-8")
    try:
        READERS[kind](file)
    except InputError as error:
        return str(error)
    return None


# -- examples --------------------------------------------------------------------------------------


def kind_of(file: Path) -> str:
    """What a TOML file of the tree is."""
    keys = tomllib.loads(file.read_text(encoding="utf-8")).keys()
    for kind, key in (("machine", "axis"), ("drive", "plant"), ("campaign", "paths")):
        if key in keys:
            return kind
    return "scenario" if keys & {"rules", "random", "host", "expect"} else "path"


FILES = [
    *sorted(EXAMPLES.rglob("*.toml")),
    *sorted((ROOT / "host_tools/hodograph/data/template").glob("*.toml")),
]


@pytest.mark.parametrize("file", FILES, ids=lambda file: f"{file.parent.name}/{file.stem}")
def test_every_example_validates(file: Path) -> None:
    document = tomllib.loads(file.read_text(encoding="utf-8"))
    errors = [
        error.message for error in Draft7Validator(schema(kind_of(file))).iter_errors(document)
    ]
    assert errors == []


def test_all_kinds_have_examples() -> None:
    assert {kind_of(file) for file in FILES} == set(NAMES)


# -- the readers ------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", NAMES)
def test_schemas_are_schemas(kind: str) -> None:
    Draft7Validator.check_schema(schema(kind))
    assert json.loads(json.dumps(schema(kind), allow_nan=False)) == schema(kind)
    assert not valid(kind, {})


@pytest.mark.parametrize("kind", NAMES)
def test_complete_documents_are_taken_by_both(kind: str, tmp_path: Path) -> None:
    for document in COMPLETE[kind]:
        assert refusal(kind, document, tmp_path) is None
        assert valid(kind, document)


def tables(value: Any, way: Way = ()) -> Iterator[tuple[Way, Document]]:
    """Every table of a document."""
    if isinstance(value, dict):
        yield way, value
        for key, inner in value.items():
            yield from tables(inner, (*way, key))
    elif isinstance(value, list):
        for index, inner in enumerate(value):
            yield from tables(inner, (*way, index))


def at(document: Any, way: Way) -> Any:
    """What lies there."""
    for step in way:
        document = document[step]
    return document


def part_of_schema(kind: str, way: Way) -> Document:
    """The schema of what lies there."""
    found: Document = schema(kind)
    for k, step in enumerate(way):
        found = found["items"] if isinstance(step, int) else found["properties"][step]
        is_list = isinstance((*way, "")[k + 1], int)
        for one in found.get("anyOf", []):  # a table, or a list of tables
            if ("items" if is_list else "properties") in one:
                found = one
    return found


@pytest.mark.parametrize("kind", NAMES)
def test_keys_of_every_table_are_those_of_the_reader(kind: str, tmp_path: Path) -> None:
    """The reader lists the keys that it knows where none is near to an unknown one."""
    compared = 0
    for document in COMPLETE[kind]:
        for way, _ in tables(document):
            if way[-1:] == ("random",) or way[:2] == CHANNELS:  # names that the user makes up
                continue
            changed = copy.deepcopy(document)
            at(changed, way)["qqqqqqqqqqqq"] = 1
            text = refusal(kind, changed, tmp_path)
            assert text is not None, way
            known = re.search(r"qqqqqqqqqqqq\]?: unknown key; use one of: (.*)", text)
            assert known is not None, text
            assert set(known[1].split(", ")) == set(part_of_schema(kind, way)["properties"]), way
            assert not valid(kind, changed)
            compared += 1
    assert compared >= len(part_of_schema(kind, ())["properties"]) // 2


@pytest.mark.parametrize("kind", NAMES)
def test_complete_documents_have_every_key(kind: str) -> None:
    """So that the tests here are about all of them."""
    seen: set[tuple[str, ...]] = set()
    for document in COMPLETE[kind]:
        for way, table in tables(document):
            names = tuple("*" if isinstance(step, int) else step for step in way)
            seen |= {(*names, key) for key in table}
    assert {way for way in all_keys(schema(kind)) if way not in seen and not varied(way)} == set()


def varied(way: tuple[str, ...]) -> bool:
    """Keys of [vary.FIGURE], of which every figure has the same."""
    return way[:1] == ("vary",) and len(way) > 1


@pytest.mark.parametrize("several", [False, True])
def test_a_wrong_key_of_a_path_is_named(several: bool) -> None:
    """Rather than the whole table marked as neither a path nor a list of paths."""
    curve = {"closed": False, "through": [[0, 0], [1, 1]], "cloesd": True}
    document = {"path": [curve] if several else curve}
    errors = [each.message for each in VALIDATORS["path"].iter_errors(document)]
    assert any("'cloesd' was unexpected" in each for each in errors)


def all_keys(part: Document, way: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """Every key that a schema names."""
    for key, inner in part.get("properties", {}).items():
        yield (*way, key)
        yield from all_keys(inner, (*way, key))
    items = part.get("items")
    if isinstance(items, dict):
        yield from all_keys(items, (*way, "*"))


@dataclass(frozen=True)
class Change:
    """Another value somewhere; None: taken out."""

    document: Document
    way: Way
    value: Any

    def made(self) -> Document:
        """The changed document."""
        document = copy.deepcopy(self.document)
        table = at(document, self.way[:-1])
        if self.value is None:
            del table[self.way[-1]]
        else:
            table[self.way[-1]] = self.value
        return document

    def __str__(self) -> str:
        return f"{'.'.join(map(str, self.way))} = {self.value!r}"


def values_of(part: Document) -> Iterator[Any]:
    """Values at and beyond what a schema allows, and of other types."""
    yield from (None, "", "  ", "a word", True, 1, 1.5, [], [1], [1, 2], [[1, 2]], ["a", "a"], {})
    for one in (part, *part.get("anyOf", ()), part.get("items", {})):
        if not isinstance(one, dict):
            continue
        yield from one.get("enum", ())
        for name, beyond in (("minimum", -1), ("maximum", 1)):
            if name in one:
                bound = one[name]
                step = 1 if one["type"] == "integer" else 1e-3 * max(abs(bound), 1e-9)
                far = bound + beyond * step
                yield from (bound, far, [bound, bound], [far, far], [bound, far])
    if part.get("multipleOf"):
        yield part["multipleOf"] + 1


def changes(kind: str) -> Iterator[Change]:
    """Every value of the complete documents, changed."""
    for document in COMPLETE[kind]:
        for way, table in tables(document):
            if way[:2] in (("axis", 1), CHANNELS):  # as the one before; names of the user's own
                continue
            part = part_of_schema(kind, way)
            for key in table:
                inner = part["properties"].get(key, part.get("additionalProperties"))
                for value in values_of(inner if isinstance(inner, dict) else {}):
                    yield Change(document, (*way, key), value)


BEYOND_SCHEMAS = (
    r"does not apply to (a path that|path \d+, which)",
    r"give all of one kind",
    r"vary\.\w+\] axis cannot be",
    r"u32 in counts",
    r"which is not there",
    r"must be (above|below) \w+ = ",
    r"must be \[least, greatest\]",
    r'names "\w+", but the axes are',
    r"is taken by the controller",
    r"must be the same for all axes",
    r"homing\] offset_\w+ must be from",
    r"slow_\w+ is .*, above speed",
    r"both or none",
    r"which the controller or a drive has",
    r"gcode\] \w+ (cannot be|is )",
    r"at_point must be from",
    r"makes \d+ runs|is drawn: say how often",
    r'rules ".*": a needs a bus',
    r"rules\]? name what \[random\] does not give",
)
"""What readers find by comparing numbers with one another, and by looking for files."""


MANY = ("machine", "path", "campaign")
"""Kinds with so many changes that `make test` takes every third one."""


@pytest.mark.parametrize(
    ("kind", "step"),
    [(kind, 3 if kind in MANY else 1) for kind in NAMES] + [long(kind, 1) for kind in MANY],
)
def test_verdicts_are_those_of_the_reader(kind: str, step: int, tmp_path: Path) -> None:
    """A schema never refuses what the reader takes; what the reader refuses alone is beyond a schema."""
    too_strict, too_lax, both = [], [], 0
    for change in islice(changes(kind), 0, None, step):
        document = change.made()
        text = refusal(kind, document, tmp_path)
        accepted = valid(kind, document)
        if text is None and not accepted:
            too_strict.append(str(change))
        elif text is not None and accepted:
            if not any(re.search(pattern, text) for pattern in BEYOND_SCHEMAS):
                too_lax.append(f"{change}: {text}")
        else:
            both += 1
    assert too_strict == []
    assert too_lax == []
    assert both > 100
