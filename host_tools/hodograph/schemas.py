# SPDX-License-Identifier: MIT
"""JSON schemas (draft 7) of the input files, for editors and other tools: `hodograph schema`.

A schema describes what one file may hold by itself: keys, types, ranges, and which keys go together. The readers in
config/, faults/ and campaign/ decide (docs/reference/files.md): they also compare numbers with one another and read the
files that are named.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from .campaign.definition import GREATEST_SAMPLES
from .campaign.variation import FIGURES, GRIDS, KINDS
from .config.axis_table import (
    COUNTS_PER_UNIT_MAX,
    HOMING_METHODS,
    MAX_AXES,
    U32_MAX,
    UNITS,
    in_unit,
)
from .config.drive_file import MOTOR_GAINS
from .config.path_file import COORDINATE_LIMIT_MM, LONGEST_DWELL_MS, STOPS
from .errors import InputError
from .faults.scenario import ACTIONS, NO_LIMIT
from .feed.limits import GREATEST_RESERVE, LEAST_RESERVE, POLICIES
from .feed.request import (
    GREATEST_DEGREE,
    GREATEST_FEED_MM_S,
    GREATEST_N_C,
    GREATEST_RAMP_S,
    LEAST_DEGREE,
    LEAST_FEED_MM_S,
    LEAST_RAMP_S,
    OPTIMAL,
    PROFILES,
)
from .names import INTEGRALS, INTERPOLATIONS, KERNELS, SPEEDS
from .spline import END_NAMES, KNOT_NAMES

Schema = dict[str, Any]

FEED, ACCELERATION, JERK = (0.001, 1e5), (0.01, 1e9), (0.1, 1e12)


def schema(name: str) -> Schema:
    """The schema of a kind of file, one of NAMES. Raises InputError."""
    if name not in NAMES:
        raise InputError(f'there is no schema "{name}"; use one of: {", ".join(NAMES)}')
    return {"$schema": "http://json-schema.org/draft-07/schema#", **_FILES[name]()}


# -- parts of schemas ------------------------------------------------------------------------------


def _number(text: str, low: float, high: float, default: float | None = None) -> Schema:
    return _with({"type": "number", "minimum": low, "maximum": high}, text, default)


def _integer(text: str, low: int, high: int, default: int | None = None) -> Schema:
    return _with({"type": "integer", "minimum": low, "maximum": high}, text, default)


def _choice(text: str, words: tuple[Any, ...], default: Any = None) -> Schema:
    return _with({"enum": list(words)}, text, default)


def _flag(text: str, default: bool | None = None) -> Schema:
    return _with({"type": "boolean"}, text, default)


def _text(text: str) -> Schema:
    return {"type": "string", "pattern": r"\S", "description": text}


def _either(text: str, *schemas: Schema) -> Schema:
    return {"anyOf": list(schemas), "description": text}


def _list(
    text: str, item: Schema, least: int = 1, most: int | None = None, *, distinct: bool = False
) -> Schema:
    found = {"type": "array", "items": item, "minItems": least, "description": text}
    if most is not None:
        found["maxItems"] = most
    if distinct:
        found["uniqueItems"] = True
    return found


def _vector(text: str, least: int, most: int, low: float, high: float) -> Schema:
    return _list(text, {"type": "number", "minimum": low, "maximum": high}, least, most)


def _table(
    text: str,
    properties: dict[str, Schema],
    required: tuple[str, ...] = (),
    more: Schema | None = None,
) -> Schema:
    found: Schema = {
        "type": "object",
        "description": text,
        "properties": properties,
        "additionalProperties": False,
    }
    return found | ({"required": list(required)} if required else {}) | (more or {})


def _table_or_list(text: str, table: Schema, tables: Schema) -> Schema:
    """One schema in place of a choice of two, so that editors mark the wrong key and not the whole table. Conditions on
    a list and conditions on a table may stand side by side, except for those that combine other schemas.
    """
    combining = {key: table[key] for key in ("oneOf", "allOf") if key in table}
    plain = {key: each for key, each in table.items() if key not in combining}
    of_table = {"if": {"type": "object"}, "then": combining}
    return plain | tables | of_table | {"type": ["object", "array"], "description": text}


def _with(found: Schema, text: str, default: Any) -> Schema:
    if default is not None:
        found["default"] = default
    return found | {"description": text}


def _number_or_vector(text: str, least: int, most: int, low: float, high: float) -> Schema:
    one = {"type": "number", "minimum": low, "maximum": high}
    many = {"type": "array", "items": one, "minItems": least, "maxItems": most}
    return {"anyOf": [one, many], "description": text}


def _only_with(keys: tuple[str, ...], condition: Schema) -> Schema:
    """These keys need `condition`."""
    return {"if": {"anyOf": [{"required": [key]} for key in keys]}, "then": condition}


# -- path files ------------------------------------------------------------------------------------


def _path_file() -> Schema:
    return _table(
        "A path file of Hodograph",
        {
            "path": _table_or_list(
                "The path, or [[path]]: several paths with rests between them, as one job",
                _table("The curve", *_curve()),
                _list("Paths, each of which begins where the one before ends", _listed_path()),
            ),
            "feed": _feed(),
            "limits": _limits(),
            "machine": _table(
                "The machine that the path runs on",
                {"file": _text("Machine file, relative to this file")},
            ),
            "output": _list("Outputs that switch on the path", _path_output()),
        },
        ("path",),
        {"title": "Path file"},
    )


def _path_output() -> Schema:
    places, levels = ("at_mm", "at_point", "at_fraction"), ("on", "value", "per_mm_s")
    return _table(
        "An output that switches at a place; one key for the place, one for what becomes of it",
        {
            "name": _text("The output, as the machine file calls it"),
            "at_mm": _number("Arc length", 0, 2**22),
            "at_point": _integer("Number of a point of `through`, from 0", 0, 10**7),
            "at_fraction": _number("Share of the path's length", 0, 1),
            "on": _flag("Level of a digital output"),
            "value": _number("Value of an analogue output, in its unit", -1e12, 1e12),
            "per_mm_s": _number(
                "From here on the analogue output follows the feed, by so much for each mm/s",
                -1e12,
                1e12,
            ),
        },
        ("name",),
        {"allOf": [{"oneOf": [{"required": [key]} for key in keys]} for keys in (places, levels)]},
    )


def _outputs() -> Schema:
    digital = _table("A digital output", {"digital": _integer("Number", 0, 15)}, ("digital",))
    analogue = _table(
        "An analogue output",
        {
            "analogue": _integer("Number", 0, 2),
            "scale": _number("Value on the bus for one unit, not 0", -1e9, 1e9, 1.0),
            "unit": _text("What the value is in"),
        },
        ("analogue",),
    )
    channels: Schema = {
        "type": "object",
        "description": "The outputs by name",
        "propertyNames": {"pattern": "^[A-Za-z][A-Za-z0-9_]*$"},
        "additionalProperties": {"anyOf": [digital, analogue]},
        "minProperties": 1,
    }
    codes = {
        "spindle": "Digital output: the spindle turns (M3, M4)",
        "spindle_reverse": "Digital output: counterclockwise (M4)",
        "speed": "Analogue output: S while the spindle turns",
        "mist": "Digital output: M7",
        "flood": "Digital output: M8",
    }
    laser = {"properties": {"laser_mode": {"const": True}}, "required": ["laser_mode"]}
    return _table(
        "An I/O module by CiA 401, whose outputs paths switch",
        {
            "node": _integer("Node number", 1, 127),
            "delay_ticks": _integer("Ticks by which the outputs are held back", 0, 8, 1),
            "keep_at_stop": _flag("Outputs stay on at a stop", False),
            "keep_at_fault": _flag("And at a fault, a quick stop and with the drives off", False),
            "off_at_end": _flag("Outputs go off at the end of a program", False),
            "off_in_hold": _flag("Outputs are off during a feed hold", False),
            "vendor": _integer("Vendor that the module must have; 0: any", 0, U32_MAX, 0),
            "product": _integer("Product that it must have; 0: any", 0, U32_MAX, 0),
            "channel": channels,
            "gcode": _table(
                "Outputs for words of G-code",
                {key: _text(text) for key, text in codes.items()}
                | {"laser_mode": _flag("M4: speed in proportion to the feed, as a laser", False)},
                (),
                {"if": laser, "then": {"required": ["speed"]}},
            ),
        },
        ("node", "channel"),
    )


def _points(text: str) -> Schema:
    at_most = {"type": "number", "minimum": -COORDINATE_LIMIT_MM, "maximum": COORDINATE_LIMIT_MM}
    alike = [
        {"items": {"type": "array", "items": at_most, "minItems": n, "maxItems": n}}
        for n in range(2, 7)
    ]
    return {"type": "array", "minItems": 1, "anyOf": alike, "description": text}


def _listed_path() -> Schema:
    properties, required, more = _curve()
    rests = {
        "dwell_ms": _integer("Standstill before this path", 0, LONGEST_DWELL_MS, 0),
        "stop": _choice("Whether a program stop is before it", STOPS, STOPS[0]),
        "output": _list("Outputs that switch on this path", _path_output()),
        "feed": _feed() | {"description": "The requested feed of this path, in place of [feed]"},
        "limits": _limits() | {"description": "What its plan keeps, in place of [limits]"},
    }
    return _table("A curve, and the rest before it", properties | rests, required, more)


def _curve() -> tuple[dict[str, Schema], tuple[str, ...], Schema]:
    """Properties, those that are required, and the rest of the schema of a curve."""
    open_through = {"required": ["through"], "properties": {"closed": {"const": False}}}
    return (
        {
            "closed": _flag("Whether the end of the path is its start"),
            "control_points": _points(
                "Control polygon, [[x, y], …], [[x, y, z], …], or up to three extra axes more; mm, degrees"
            ),
            "through": _points("Points that the path passes, likewise"),
            "knots": _choice(
                "How the spline's parameter follows the distances of the points",
                KNOT_NAMES,
                "chord",
            ),
            "ends": _choice("Ends of an open path through points", END_NAMES, "cubic"),
            "start_tangent": _vector("Direction at the start, in place of `ends`", 2, 3, -1e9, 1e9),
            "end_tangent": _vector("Direction at the end, in place of `ends`", 2, 3, -1e9, 1e9),
        },
        ("closed",),
        {
            "oneOf": [{"required": ["control_points"]}, {"required": ["through"]}],
            "allOf": [
                _only_with(("ends", "start_tangent", "end_tangent"), open_through),
                _only_with(("knots",), {"required": ["through"]}),
            ],
        },
    )


def _feed() -> Schema:
    return _table(
        "The requested feed",
        {
            "profile": _choice("Feed profile", PROFILES, "exponential"),
            "nominal_mm_s": _number(
                "Constant feed; with profile optimal one more limit, which may be left out",
                LEAST_FEED_MM_S,
                GREATEST_FEED_MM_S,
            ),
            "nominal_deg_s": _number(
                "The same on a path that moves rotary axes alone",
                LEAST_FEED_MM_S,
                GREATEST_FEED_MM_S,
            ),
            "ramp_time_s": _number("Duration of a feed ramp", LEAST_RAMP_S, GREATEST_RAMP_S),
            "n_c": {
                "anyOf": [{"const": "optimise"}, _number("A number", 0, GREATEST_N_C)],
                "default": "optimise",
                "description": "Slope coefficient of profile exponential",
            },
            "degree": _integer("Degree of profile minimax", LEAST_DEGREE, GREATEST_DEGREE, 5),
        },
        more={
            "if": {"properties": {"profile": {"const": OPTIMAL}}, "required": ["profile"]},
            "else": {
                "required": ["ramp_time_s"],
                "anyOf": [{"required": ["nominal_mm_s"]}, {"required": ["nominal_deg_s"]}],
            },
        },
    )


def _limits() -> Schema:
    cap = _table(
        "Feed limit between two arc lengths",
        {
            "from_mm": _number("Begin", 0, 1e7),
            "to_mm": _number("End", 0, 1e7),
            "feed_mm_s": _number("Greatest feed there", *FEED),
        },
        ("from_mm", "to_mm", "feed_mm_s"),
    )
    per_axis = "of the axes, a number for all, or one for each axis of the points"
    return _table(
        "What the plan keeps",
        {
            "feed_mm_s": _number("Greatest feed", *FEED),
            "acceleration_mm_s2": _number("Greatest acceleration along the path", *ACCELERATION),
            "jerk_mm_s3": _number("Greatest jerk along the path", *JERK),
            "feed_deg_s": _number("Greatest feed of a path that moves rotary axes alone", *FEED),
            "acceleration_deg_s2": _number("Greatest acceleration along it", *ACCELERATION),
            "jerk_deg_s3": _number("Greatest jerk along it", *JERK),
            "centripetal_mm_s2": _number("Greatest feed squared times curvature", *ACCELERATION),
            "volts": _number("Greatest volts of each axis, by its drive file", 1e-3, 1e3),
            "policy": _choice("Lower the feed, or run as asked and report", POLICIES, "respect"),
            "reserve": _number(
                "Share of axis accelerations, jerks and volts left free for resume and override",
                LEAST_RESERVE,
                GREATEST_RESERVE,
                LEAST_RESERVE,
            ),
            "axis": _table(
                "Of the motion of the axes",
                {
                    "velocity_mm_s": _number_or_vector(f"Velocity {per_axis}", 2, 6, *FEED),
                    "acceleration_mm_s2": _number_or_vector(
                        f"Acceleration {per_axis}", 2, 6, *ACCELERATION
                    ),
                    "jerk_mm_s3": _number_or_vector(f"Jerk {per_axis}", 2, 6, *JERK),
                },
            ),
            "cap": _list("Feed zones", cap),
        },
    )


# -- machine files ---------------------------------------------------------------------------------


def _machine_file() -> Schema:
    return _table(
        "A machine file of Hodograph",
        {
            "path": _list(
                "Names of the axes that follow a path, in its order",
                _text("Name"),
                2,
                MAX_AXES,
                distinct=True,
            ),
            "bus": _table(
                "The CAN bus",
                {
                    "bitrate": _integer("bit/s", 10_000, 1_000_000, 1_000_000),
                    "period_us": _choice("Period of SYNC", (1000, 2000, 4000, 8000), 1000),
                },
            ),
            "controller": _controller(),
            "supervision": _table(
                "When answers or setpoints that stay away become a fault",
                {
                    "answer_wait_ms": _integer("Wait for a TPDO1", 0, 10_000, 100),
                    "missed_max": _integer("Missed TPDO1s in a row that are tolerated", 0, 255, 1),
                    "setpoint_timeout_ms": _integer(
                        "A drive without setpoints for so long stops by itself", 10, 60_000, 200
                    ),
                },
            ),
            "work": _table(
                "Work offset",
                {
                    "offset_mm": _vector(
                        "Added to every point of a path; one number for each of its axes",
                        2,
                        MAX_AXES,
                        -4096,
                        4096,
                    )
                },
            ),
            "outputs": _outputs(),
            "axis": _list("The axes", _axis(), 1, MAX_AXES),
        },
        ("controller", "axis"),
        {"title": "Machine file"},
    )


def _controller() -> Schema:
    return _table(
        "The controller, and its own limits along the path, which always bind",
        {
            "node": _integer("Node number", 1, 127, 1),
            "kernel": _choice("Number kernel", KERNELS, "fixed"),
            "feed_mm_s": _number("Greatest feed", 0.01, 4000),
            "acceleration_mm_s2": _number("Greatest acceleration along the path", 0.1, 4e6),
            "jerk_mm_s3": _number("Greatest jerk along the path", 1, 4e9),
            "reserve": _number("Share of these that plans leave free", 0, 0.9, 0.1),
            "stop_time_ms": _integer("Longest fault stop of a program", 1, 60_000, 250),
            "start_tolerance_mm": _number(
                "Largest distance from its start at which a program starts", 1e-6, 10, 0.005
            ),
            "program_bytes": _integer("Memory for a program", 0, U32_MAX),
        },
        ("feed_mm_s", "acceleration_mm_s2", "jerk_mm_s3"),
    )


def _in_units(properties: dict[str, Schema]) -> dict[str, Schema]:
    """The same for a rotary axis, whose keys are in degrees."""
    turning = {
        in_unit(key, "deg"): one | {"description": one["description"].replace("mm", "degrees")}
        for key, one in properties.items()
        if in_unit(key, "deg") != key
    }
    return properties | turning


def _axis() -> Schema:
    counted = (1e-6, 1e9)
    limits = ("velocity_mm_s", "acceleration_mm_s2", "jerk_mm_s3")
    properties = _in_units(
        {
            "name": _text("Name of the axis, for messages and traces"),
            "unit": _choice("mm, or deg of a rotary axis", UNITS, "mm"),
            "node": _integer("Node number of its drive", 1, 127),
            "travel_mm": _vector("[least, greatest] position, mm", 2, 2, -4096, 4096),
            "velocity_mm_s": _number("Greatest velocity, mm/s", 0.01, 4000),
            "acceleration_mm_s2": _number("Greatest acceleration, mm/s^2", 0.1, 4e6),
            "jerk_mm_s3": _number("Greatest jerk, mm/s^3", 1, 4e9),
            "counts_per_mm": _integer(
                "Counts on the bus for 1 mm; the same for all axes in mm",
                1000,
                COUNTS_PER_UNIT_MAX,
                1_000_000,
            ),
            "drive": _either(
                "Drive file, for simulation, relative to this file; or a table with its contents",
                {"type": "string", "pattern": r"\S"},
                _drive_file(),
            ),
            "following_window_mm": _number("Following error window (0x6065), mm", *counted),
            "following_timeout_ms": _integer("Its time (0x6066)", 0, 65535, 10),
            "quick_stop_mm_s2": _number("Deceleration of a quick stop (0x6085), mm/s^2", *counted),
        }
    )
    tables = {
        "homing": _table(
            "How hodograph home finds the zero of the axis",
            _in_units(
                {
                    "method": _choice("Of CiA 402; 0: no homing", HOMING_METHODS),
                    "sequence": _integer(
                        "Axes home from the lowest number on; 0 for z, else 1", 0, 15
                    ),
                    "offset_mm": _number("Home position (0x607C), mm", -2147484, 2147484, 0),
                    "speed_mm_s": _number("Towards the switch, mm/s", *counted, 10),
                    "slow_mm_s": _number("Away from it, mm/s", *counted, 1),
                    "acceleration_mm_s2": _number("Of homing, mm/s^2", *counted, 100),
                }
            ),
            ("method",),
        ),
        "feedforward": _table(
            "What the controller sends beside the setpoint",
            _in_units(
                {
                    "velocity": _number("Share of the setpoint velocity (0x60B1)", 0, 2, 0),
                    "torque_permille_s2_m": _number(
                        "Torque offset (0x60B2) for 1 m/s^2", -32767, 32767, 0
                    ),
                    "torque_permille_s_m": _number(
                        "Torque offset (0x60B2) for 1 m/s", -32767, 32767, 0
                    ),
                }
            ),
        ),
        "scaling": _scaling(),
        "identity": _table(
            "What the drive says of itself (0x1018); another one is not configured",
            {
                key: _integer(key.capitalize(), 1, U32_MAX)
                for key in ("vendor", "product", "revision")
            },
        ),
    }
    return _table(
        "An axis and its drive",
        properties | tables,
        ("name", "node"),
        {
            "if": {"properties": {"unit": {"const": "deg"}}, "required": ["unit"]},
            "then": _keys_of("deg", ("travel_mm", *limits)),
            "else": _keys_of("mm", ("travel_mm", *limits)),
        },
    )


def _keys_of(unit: str, required: tuple[str, ...]) -> Schema:
    """An axis has the keys of its unit and none of the other."""
    other = r"(^|_)mm(_|$)|_m$" if unit == "deg" else r"(^|_)k?deg(_|$)"
    names = {"propertyNames": {"not": {"pattern": other}}}
    inner = dict.fromkeys(("homing", "feedforward"), names)
    return names | {"required": [in_unit(key, unit) for key in required], "properties": inner}


def _scaling() -> Schema:
    gear = ("gear_motor_revolutions", "gear_shaft_revolutions")
    return _table(
        "What the controller writes to the drive's objects; 0: the drive's own value stays",
        {
            "encoder_increments_per_rev": _integer("0x608F", 0, U32_MAX),
            "feed_counts_per_rev": _integer("0x6092", 0, U32_MAX),
            **{key: _integer("0x6091", 0, U32_MAX) for key in gear},
        },
    )


# -- drive files -----------------------------------------------------------------------------------


def _drive_file() -> Schema:
    plant = {
        "gain_rad_s_v": _number("K: shaft speed for one volt, rad/(s V)", 1e-3, 1e6),
        "time_constant_s": _number("T of the first-order lag", 1e-5, 1e3),
        "screw_mm_rad": _number("g: table motion for one radian", 1e-4, 1e3),
        "torque_to_volts": _number("k: volts for 1 N m", 1e-6, 1e6),
        "volts_limit": _number("Largest voltage", 1e-3, 32.767),
    }
    always = {
        "k_pv_nm_s_rad": _number("Gain of the servo loop", 0, 1e6),
        "k_iv_per_s": _number("Gain of the servo loop", 0, 1e6),
        "k_vf": _number("Gain of the servo loop", 0, 1e3),
    }
    in_one_unit = {
        key: _number(f"Gain of the servo loop in {unit}", 0, 1e6)
        for keys, unit in (
            (MOTOR_GAINS, "mm of table motion"),
            (MOTOR_GAINS.values(), "rad of the motor"),
        )
        for key in keys
    }
    integral = _choice("Euler's method of the loop's integral", INTEGRALS, "backward")
    pairs = [
        {"oneOf": [{"required": [by_table]}, {"required": [by_motor]}]}
        for by_table, by_motor in MOTOR_GAINS.items()
    ]
    return _table(
        "A drive file of Hodograph: one simulated axis",
        {
            "plant": _table("Motor and screw", plant, tuple(plant)),
            "pdff": _table(
                "Gains of the servo loop",
                always | in_one_unit | {"integral": integral},
                tuple(always),
                {"allOf": pairs},
            ),
            "encoder": _table(
                "Encoder",
                {
                    "counts_per_rev": _integer("Increments for one turn", 16, 2**26, 2**20),
                    "speed": _choice("Speed that the loop uses", SPEEDS, "exact"),
                },
            ),
            "servo": _table(
                "Servo loop",
                {
                    "loop_rate_hz": _integer(
                        "Servo samples a second, a multiple of 1000", 1000, 64000, 16000
                    )
                    | {"multipleOf": 1000},
                    "interpolation": _choice("Between setpoints", INTERPOLATIONS, "linear"),
                    "delay_samples": _integer("Samples from encoder to volts", 0, 1, 0),
                },
            ),
            "equipment": _equipment(),
        },
        ("plant", "pdff"),
        {"title": "Drive file"},
    )


def _equipment() -> Schema:
    def place(text: str) -> Schema:
        return _number(text, -1e6, 1e6)

    return _table(
        "What stands around the motor",
        {
            "limit_negative_mm": place("Place of the limit switch"),
            "limit_positive_mm": place("Place of the limit switch"),
            "home_from_mm": place("The home switch is on from here"),
            "home_to_mm": place("The home switch is on up to here"),
            "rated_torque_nm": _number("Rated torque", 1e-9, 1e6),
            "rated_current_a": _number("Rated current", 1e-9, 1e6),
            "overload_s": _number("How long full voltage may last", 0, 1e6),
            "friction_volts": _number("Coulomb friction, as voltage", 0, 1e6, 0),
            "brake_volts": _number("Friction of the holding brake, as voltage", 1e-9, 1e6),
        },
        more={"dependencies": {"home_from_mm": ["home_to_mm"], "home_to_mm": ["home_from_mm"]}},
    )


# -- campaign files and fault scenarios --------------------------------------------------------------


def _campaign_file() -> Schema:
    pdff = ("k_pp_rad_s_mm", "k_pv_nm_s_rad", "k_iv_per_s", "k_pf_rad_mm", "k_vf")
    forward = ("velocity", "torque_permille_s2_m", "torque_permille_s_m")
    gains = _table(
        "Gains to try",
        {
            "name": _text("For the table of results"),
            "machine": _text("Machine file with these gains"),
            **{key: _number_or_vector("For all axes, or each", 2, 6, 0, 1e6) for key in pdff},
            "feedforward": _table(
                "As of [[axis]] of a machine file",
                {
                    key: _number_or_vector("For all axes, or each", 2, 6, 0, 32767)
                    for key in forward
                },
            ),
            "interpolation": _choice("Of setpoints in the drives", INTERPOLATIONS),
        },
        ("name",),
    )
    faults = _table(
        "A fault to try; without rules and scenario: none",
        {
            "name": _text("For the table of results"),
            "scenario": _text("Scenario file"),
            "rules": _rules(),
            "random": _random(),
        },
        ("name",),
        {
            "allOf": [
                {"not": {"required": ["scenario", "rules"]}},
                _only_with(("random",), {"required": ["rules"]}),
            ]
        },
    )
    return _table(
        "A campaign file of Hodograph: many simulated runs",
        {
            "text": _text("Title of the report"),
            "paths": _list("Path files", _text("Path file"), distinct=True),
            "machine": _text("Machine file in place of the paths' own"),
            "kernel": _choice("Number kernel in place of the machines' own", KERNELS),
            "profiles": _list("Feed profiles to try", {"enum": list(PROFILES)}, distinct=True),
            "feeds_mm_s": _list(
                "Feeds to try",
                {"type": "number", "minimum": LEAST_FEED_MM_S, "maximum": GREATEST_FEED_MM_S},
                distinct=True,
            ),
            "samples": _integer("Draws of everything random", 1, GREATEST_SAMPLES, 1),
            "seed": _integer("Of the random draws", 0, 2**31, 0),
            "gains": _list("Gains to try", gains),
            "faults": _list("Faults to try", faults),
            "vary": _table("Figures of the drives that vary", {key: _vary(key) for key in FIGURES}),
        },
        ("paths",),
        {"title": "Campaign file"},
    )


def _vary(figure: str) -> Schema:
    numbers: Schema = {"type": "number", "minimum": -1e9, "maximum": 1e9}
    kinds = {
        kind: _list("Each in turn", numbers, distinct=True)
        if kind in GRIDS
        else _list("Two numbers of the distribution", numbers, 2, 2)
        for kind in KINDS
    }
    return _table(
        f"How {figure} varies",
        kinds | {"axis": _text('The name of one axis, "all" alike, or "each" by itself')},
        more={
            "oneOf": [{"required": [kind]} for kind in KINDS],
            "if": {"properties": {"axis": {"const": "each"}}, "required": ["axis"]},
            "then": {"not": {"anyOf": [{"required": [kind]} for kind in GRIDS]}},
        },
    )


def _rules() -> Schema:
    return {
        "type": "array",
        "items": {"type": "string"},
        "description": "Fault rules (protocol.md section 4), with drawn names in braces",
    }


def _random() -> Schema:
    whole = {"type": "array", "items": {"type": "integer"}, "minItems": 2, "maxItems": 2}
    words = {"type": "array", "items": {"type": "string"}, "minItems": 1}
    return {
        "type": "object",
        "properties": {"at": whole},
        "additionalProperties": {"anyOf": [whole, words]},
        "description": "Names that a seed draws: [least, greatest], or one of a list of words",
    }


def _scenario_file() -> Schema:
    limits = {
        key: _integer(text, 0, NO_LIMIT)
        for key, text in (
            ("within_ticks", "From the first injection to the fault"),
            ("within_ms", "The same in wall time"),
            ("rest_ticks", "From the fault until the axes are at rest"),
            ("rest_ms", "The same in wall time"),
            ("recover_ms", "From the reset until the drives are configured anew"),
        )
    }
    expect = _table(
        "What must come of it",
        limits
        | {
            "codes": {
                "type": "array",
                "items": {"type": "integer"},
                "description": "Fault codes of which one must be raised; none: no fault",
            },
            "may": _flag("The fault is allowed, not required", False),
            "same_encoders": _flag("Encoder values are those without the fault", True),
            "unseen": _flag("A drive may be silent as its axis comes to rest", False),
            "on_path": _flag("The setpoints come to rest on the path", False),
        },
    )
    return _table(
        "A fault scenario of Hodograph",
        {
            "text": _text("What happens"),
            "path": _text("Path file, relative to this file"),
            "rules": _rules(),
            "random": _random(),
            "host": _table(
                "What the host does", {"action": _choice("At tick {at}", ACTIONS, "none")}
            ),
            "expect": expect,
        },
        ("text", "path"),
        {"title": "Fault scenario"},
    )


_FILES: dict[str, Callable[[], Schema]] = {
    "path": _path_file,
    "machine": _machine_file,
    "drive": _drive_file,
    "campaign": _campaign_file,
    "scenario": _scenario_file,
}
NAMES = tuple(_FILES)
"""Kinds of input files."""
