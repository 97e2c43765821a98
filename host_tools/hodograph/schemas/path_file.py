# SPDX-License-Identifier: MIT
"""The JSON schema of path files, and of the outputs in machine files. Used by schemas/machine_file and `schema` of this
package. No I/O.
"""

from __future__ import annotations

from ..config.axis_table import (
    U32_MAX,
)
from ..config.path_file import COORDINATE_LIMIT_MM, LONGEST_DWELL_MS, STOPS
from ..feed.limits import GREATEST_RESERVE, LEAST_RESERVE, POLICIES
from ..feed.request import (
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
from ..spline import END_NAMES, KNOT_NAMES
from . import parts
from .parts import Schema

FEED, ACCELERATION, JERK = (0.001, 1e5), (0.01, 1e9), (0.1, 1e12)
"""Ranges of limits in mm, or degrees, and s."""


def path_file() -> Schema:
    """The schema of a path file, without $schema."""
    return parts.table(
        "A path file of Hodograph",
        {
            "path": parts.table_or_list(
                "The path, or [[path]]: several paths with rests between them, as one job",
                parts.table("The curve", *_curve()),
                parts.list_of(
                    "Paths, each of which begins where the one before ends", _listed_path()
                ),
            ),
            "feed": _feed(),
            "limits": _limits(),
            "machine": parts.table(
                "The machine that the path runs on",
                {"file": parts.text("Machine file, relative to this file")},
            ),
            "output": parts.list_of("Outputs that switch on the path", _path_output()),
        },
        ("path",),
        {"title": "Path file"},
    )


def _path_output() -> Schema:
    places, levels = ("at_mm", "at_point", "at_fraction"), ("on", "value", "per_mm_s")
    return parts.table(
        "An output that switches at a place; one key for the place, one for what becomes of it",
        {
            "name": parts.text("The output, as the machine file calls it"),
            "at_mm": parts.number("Arc length", 0, 2**22),
            "at_point": parts.integer("Number of a point of `through`, from 0", 0, 10**7),
            "at_fraction": parts.number("Share of the path's length", 0, 1),
            "on": parts.flag("Level of a digital output"),
            "value": parts.number("Value of an analogue output, in its unit", -1e12, 1e12),
            "per_mm_s": parts.number(
                "From here on the analogue output follows the feed, by so much for each mm/s",
                -1e12,
                1e12,
            ),
        },
        ("name",),
        {"allOf": [{"oneOf": [{"required": [key]} for key in keys]} for keys in (places, levels)]},
    )


def outputs() -> Schema:
    """The schema of [outputs] of a machine file."""
    digital = parts.table(
        "A digital output", {"digital": parts.integer("Number", 0, 15)}, ("digital",)
    )
    analogue = parts.table(
        "An analogue output",
        {
            "analogue": parts.integer("Number", 0, 2),
            "scale": parts.number("Value on the bus for one unit, not 0", -1e9, 1e9, 1.0),
            "unit": parts.text("What the value is in"),
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
    of_laser = {
        "if": {"properties": {"laser_mode": {"const": True}}, "required": ["laser_mode"]},
        "then": {"required": ["speed"], "properties": {"spindle_wait_s": {"const": 0}}},
    }
    positive = {"exclusiveMinimum": 0}
    of_wait = {
        "if": {"properties": {"spindle_wait_s": positive}, "required": ["spindle_wait_s"]},
        "then": {"anyOf": [{"required": ["spindle"]}, {"required": ["speed"]}]},
    }
    return parts.table(
        "An I/O module by CiA 401, whose outputs paths switch",
        {
            "node": parts.integer("Node number", 1, 127),
            "delay_ticks": parts.integer("Ticks by which the outputs are held back", 0, 8, 1),
            "keep_at_stop": parts.flag("Outputs stay on at a stop", False),
            "keep_at_fault": parts.flag(
                "And at a fault, a quick stop and with the drives off", False
            ),
            "off_at_end": parts.flag("Outputs go off at the end of a program", False),
            "off_in_hold": parts.flag("Outputs are off during a feed hold", False),
            "vendor": parts.integer("Vendor that the module must have; 0: any", 0, U32_MAX, 0),
            "product": parts.integer("Product that it must have; 0: any", 0, U32_MAX, 0),
            "channel": channels,
            "gcode": parts.table(
                "Outputs for words of G-code",
                {key: parts.text(text) for key, text in codes.items()}
                | {
                    "laser_mode": parts.flag(
                        "M4: speed in proportion to the feed, as a laser", False
                    ),
                    "spindle_wait_s": parts.number(
                        "Wait after the spindle starts or turns over, s", 0.0, 600.0, 0.0
                    ),
                },
                (),
                {"allOf": [of_laser, of_wait]},
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
        "dwell_ms": parts.integer("Standstill before this path", 0, LONGEST_DWELL_MS, 0),
        "stop": parts.choice("Whether a program stop is before it", STOPS, STOPS[0]),
        "output": parts.list_of("Outputs that switch on this path", _path_output()),
        "feed": _feed() | {"description": "The requested feed of this path, in place of [feed]"},
        "limits": _limits() | {"description": "What its plan keeps, in place of [limits]"},
    }
    return parts.table("A curve, and the rest before it", properties | rests, required, more)


def _curve() -> tuple[dict[str, Schema], tuple[str, ...], Schema]:
    """Properties, those that are required, and the rest of the schema of a curve."""
    open_through = {"required": ["through"], "properties": {"closed": {"const": False}}}
    return (
        {
            "closed": parts.flag("Whether the end of the path is its start"),
            "control_points": _points(
                "Control polygon, [[x, y], …], [[x, y, z], …], or up to three extra axes more; mm, degrees"
            ),
            "through": _points("Points that the path passes, likewise"),
            "knots": parts.choice(
                "How the spline's parameter follows the distances of the points",
                KNOT_NAMES,
                "chord",
            ),
            "ends": parts.choice("Ends of an open path through points", END_NAMES, "cubic"),
            "start_tangent": parts.vector(
                "Direction at the start, in place of `ends`", 2, 3, -1e9, 1e9
            ),
            "end_tangent": parts.vector(
                "Direction at the end, in place of `ends`", 2, 3, -1e9, 1e9
            ),
        },
        ("closed",),
        {
            "oneOf": [{"required": ["control_points"]}, {"required": ["through"]}],
            "allOf": [
                parts.only_with(("ends", "start_tangent", "end_tangent"), open_through),
                parts.only_with(("knots",), {"required": ["through"]}),
            ],
        },
    )


def _feed() -> Schema:
    return parts.table(
        "The requested feed",
        {
            "profile": parts.choice("Feed profile", PROFILES, "exponential"),
            "nominal_mm_s": parts.number(
                "Constant feed; with profile optimal one more limit, which may be left out",
                LEAST_FEED_MM_S,
                GREATEST_FEED_MM_S,
            ),
            "nominal_deg_s": parts.number(
                "The same on a path that moves rotary axes alone",
                LEAST_FEED_MM_S,
                GREATEST_FEED_MM_S,
            ),
            "ramp_time_s": parts.number("Duration of a feed ramp", LEAST_RAMP_S, GREATEST_RAMP_S),
            "n_c": {
                "anyOf": [{"const": "optimise"}, parts.number("A number", 0, GREATEST_N_C)],
                "default": "optimise",
                "description": "Slope coefficient of profile exponential",
            },
            "degree": parts.integer("Degree of profile minimax", LEAST_DEGREE, GREATEST_DEGREE, 5),
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
    cap = parts.table(
        "Feed limit between two arc lengths",
        {
            "from_mm": parts.number("Begin", 0, 1e7),
            "to_mm": parts.number("End", 0, 1e7),
            "feed_mm_s": parts.number("Greatest feed there", *FEED),
        },
        ("from_mm", "to_mm", "feed_mm_s"),
    )
    per_axis = "of the axes, a number for all, or one for each axis of the points"
    return parts.table(
        "What the plan keeps",
        {
            "feed_mm_s": parts.number("Greatest feed", *FEED),
            "acceleration_mm_s2": parts.number(
                "Greatest acceleration along the path", *ACCELERATION
            ),
            "jerk_mm_s3": parts.number("Greatest jerk along the path", *JERK),
            "feed_deg_s": parts.number(
                "Greatest feed of a path that moves rotary axes alone", *FEED
            ),
            "acceleration_deg_s2": parts.number("Greatest acceleration along it", *ACCELERATION),
            "jerk_deg_s3": parts.number("Greatest jerk along it", *JERK),
            "centripetal_mm_s2": parts.number(
                "Greatest feed squared times curvature", *ACCELERATION
            ),
            "volts": parts.number("Greatest volts of each axis, by its drive file", 1e-3, 1e3),
            "policy": parts.choice(
                "Lower the feed, or run as asked and report", POLICIES, "respect"
            ),
            "reserve": parts.number(
                "Share of axis accelerations, jerks and volts left free for resume and override",
                LEAST_RESERVE,
                GREATEST_RESERVE,
                LEAST_RESERVE,
            ),
            "axis": parts.table(
                "Of the motion of the axes",
                {
                    "velocity_mm_s": parts.number_or_vector(f"Velocity {per_axis}", 2, 6, *FEED),
                    "acceleration_mm_s2": parts.number_or_vector(
                        f"Acceleration {per_axis}", 2, 6, *ACCELERATION
                    ),
                    "jerk_mm_s3": parts.number_or_vector(f"Jerk {per_axis}", 2, 6, *JERK),
                },
            ),
            "cap": parts.list_of("Feed zones", cap),
        },
    )
