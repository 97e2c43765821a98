# SPDX-License-Identifier: MIT
"""The JSON schemas of machine files and drive files. Used by `schema` of this package. No I/O."""

from __future__ import annotations

from ..config.axis_table import (
    COUNTS_PER_UNIT_MAX,
    HOMING_METHODS,
    MAX_AXES,
    U32_MAX,
    UNITS,
    in_unit,
)
from ..config.drive_file import MOTOR_GAINS
from ..names import INTEGRALS, INTERPOLATIONS, KERNELS, SPEEDS
from . import parts
from .parts import Schema
from .path_file import outputs


def machine_file() -> Schema:
    """The schema of a machine file, without $schema."""
    return parts.table(
        "A machine file of Hodograph",
        {
            "path": parts.list_of(
                "Names of the axes that follow a path, in its order",
                parts.text("Name"),
                2,
                MAX_AXES,
                distinct=True,
            ),
            "bus": parts.table(
                "The CAN bus",
                {
                    "bitrate": parts.integer("bit/s", 10_000, 1_000_000, 1_000_000),
                    "period_us": parts.choice("Period of SYNC", (1000, 2000, 4000, 8000), 1000),
                },
            ),
            "controller": _controller(),
            "supervision": parts.table(
                "When answers or setpoints that stay away become a fault",
                {
                    "answer_wait_ms": parts.integer("Wait for a TPDO1", 0, 10_000, 100),
                    "missed_max": parts.integer(
                        "Missed TPDO1s in a row that are tolerated", 0, 255, 1
                    ),
                    "setpoint_timeout_ms": parts.integer(
                        "A drive without setpoints for so long stops by itself", 10, 60_000, 200
                    ),
                },
            ),
            "work": parts.table(
                "Where a path lies in the machine",
                {
                    "offset_mm": parts.vector(
                        "Added to every point of a path; one number for each of its axes",
                        2,
                        MAX_AXES,
                        -4096,
                        4096,
                    ),
                    "start_mm": parts.vector(
                        "Where a toolpath starts, in its own coordinates; one number for each of its axes",
                        2,
                        MAX_AXES,
                        -4096,
                        4096,
                    ),
                },
            ),
            "outputs": outputs(),
            "axis": parts.list_of("The axes", _axis(), 1, MAX_AXES),
        },
        ("controller", "axis"),
        {"title": "Machine file"},
    )


def _controller() -> Schema:
    return parts.table(
        "The controller, and its own limits along the path, for every program",
        {
            "node": parts.integer("Node number", 1, 127, 1),
            "kernel": parts.choice("Number kernel", KERNELS, "fixed"),
            "feed_mm_s": parts.number("Greatest feed", 0.01, 4000),
            "acceleration_mm_s2": parts.number("Greatest acceleration along the path", 0.1, 4e6),
            "jerk_mm_s3": parts.number("Greatest jerk along the path", 1, 4e9),
            "reserve": parts.number("Share of these that plans leave free", 0, 0.9, 0.1),
            "stop_time_ms": parts.integer("Longest fault stop of a program", 1, 60_000, 250),
            "start_tolerance_mm": parts.number(
                "Largest distance from its start at which a program starts", 1e-6, 10, 0.005
            ),
            "program_bytes": parts.integer("Memory for a program", 0, U32_MAX),
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
            "name": parts.text("Name of the axis, for messages and traces"),
            "unit": parts.choice("mm, or deg of a rotary axis", UNITS, "mm"),
            "node": parts.integer("Node number of its drive", 1, 127),
            "travel_mm": parts.vector("[least, greatest] position, mm", 2, 2, -4096, 4096),
            "velocity_mm_s": parts.number("Greatest velocity, mm/s", 0.01, 4000),
            "acceleration_mm_s2": parts.number("Greatest acceleration, mm/s^2", 0.1, 4e6),
            "jerk_mm_s3": parts.number("Greatest jerk, mm/s^3", 1, 4e9),
            "counts_per_mm": parts.integer(
                "Counts on the bus for 1 mm; the same for all axes in mm",
                1000,
                COUNTS_PER_UNIT_MAX,
                1_000_000,
            ),
            "drive": parts.either(
                "Drive file, for simulation, relative to this file; or a table with its contents",
                {"type": "string", "pattern": r"\S"},
                drive_file(),
            ),
            "following_window_mm": parts.number("Following error window (0x6065), mm", *counted),
            "following_timeout_ms": parts.integer("Its time (0x6066)", 0, 65535, 10),
            "quick_stop_mm_s2": parts.number(
                "Deceleration of a quick stop (0x6085), mm/s^2", *counted
            ),
        }
    )
    tables = {
        "homing": parts.table(
            "How hodograph home finds the zero of the axis",
            _in_units(
                {
                    "method": parts.choice("Of CiA 402; 0: no homing", HOMING_METHODS),
                    "sequence": parts.integer(
                        "Axes home from the lowest number on; 0 for z, else 1", 0, 15
                    ),
                    "offset_mm": parts.number("Home position (0x607C), mm", -2147484, 2147484, 0),
                    "speed_mm_s": parts.number("Towards the switch, mm/s", *counted, 10),
                    "slow_mm_s": parts.number("Away from it, mm/s", *counted, 1),
                    "acceleration_mm_s2": parts.number("Of homing, mm/s^2", *counted, 100),
                }
            ),
            ("method",),
        ),
        "feedforward": parts.table(
            "What the controller sends beside the setpoint",
            _in_units(
                {
                    "velocity": parts.number("Share of the setpoint velocity (0x60B1)", 0, 2, 0),
                    "torque_permille_s2_m": parts.number(
                        "Torque offset (0x60B2) for 1 m/s^2", -32767, 32767, 0
                    ),
                    "torque_permille_s_m": parts.number(
                        "Torque offset (0x60B2) for 1 m/s", -32767, 32767, 0
                    ),
                }
            ),
        ),
        "scaling": _scaling(),
        "identity": parts.table(
            "What the drive says of itself (0x1018); another one is not configured",
            {
                key: parts.integer(key.capitalize(), 1, U32_MAX)
                for key in ("vendor", "product", "revision")
            },
        ),
    }
    return parts.table(
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
    return parts.table(
        "What the controller writes to the drive's objects; 0: the drive's own value stays",
        {
            "encoder_increments_per_rev": parts.integer("0x608F", 0, U32_MAX),
            "feed_counts_per_rev": parts.integer("0x6092", 0, U32_MAX),
            **{key: parts.integer("0x6091", 0, U32_MAX) for key in gear},
        },
    )


def drive_file() -> Schema:
    """The schema of a drive file, without $schema; also of a table `drive` of an axis."""
    plant = {
        "gain_rad_s_v": parts.number("K: shaft speed for one volt, rad/(s V)", 1e-3, 1e6),
        "time_constant_s": parts.number("T of the first-order lag", 1e-5, 1e3),
        "screw_mm_rad": parts.number("g: table motion for one radian", 1e-4, 1e3),
        "torque_to_volts": parts.number("k: volts for 1 N m", 1e-6, 1e6),
        "volts_limit": parts.number("Largest voltage", 1e-3, 32.767),
    }
    always = {
        "k_pv_nm_s_rad": parts.number("Gain of the servo loop", 0, 1e6),
        "k_iv_per_s": parts.number("Gain of the servo loop", 0, 1e6),
        "k_vf": parts.number("Gain of the servo loop", 0, 1e3),
    }
    in_one_unit = {
        key: parts.number(f"Gain of the servo loop in {unit}", 0, 1e6)
        for keys, unit in (
            (MOTOR_GAINS, "mm of table motion"),
            (MOTOR_GAINS.values(), "rad of the motor"),
        )
        for key in keys
    }
    integral = parts.choice("Euler's method of the loop's integral", INTEGRALS, "backward")
    pairs = [
        {"oneOf": [{"required": [by_table]}, {"required": [by_motor]}]}
        for by_table, by_motor in MOTOR_GAINS.items()
    ]
    return parts.table(
        "A drive file of Hodograph: one simulated axis",
        {
            "plant": parts.table("Motor and screw", plant, tuple(plant)),
            "pdff": parts.table(
                "Gains of the servo loop",
                always | in_one_unit | {"integral": integral},
                tuple(always),
                {"allOf": pairs},
            ),
            "encoder": parts.table(
                "Encoder",
                {
                    "counts_per_rev": parts.integer("Increments for one turn", 16, 2**26, 2**20),
                    "speed": parts.choice("Speed that the loop uses", SPEEDS, "exact"),
                },
            ),
            "servo": parts.table(
                "Servo loop",
                {
                    "loop_rate_hz": parts.integer(
                        "Servo samples a second, a multiple of 1000", 1000, 64000, 16000
                    )
                    | {"multipleOf": 1000},
                    "interpolation": parts.choice("Between setpoints", INTERPOLATIONS, "linear"),
                    "delay_samples": parts.integer("Samples from encoder to volts", 0, 1, 0),
                },
            ),
            "equipment": _equipment(),
        },
        ("plant", "pdff"),
        {"title": "Drive file"},
    )


def _equipment() -> Schema:
    def place(text: str) -> Schema:
        return parts.number(text, -1e6, 1e6)

    return parts.table(
        "What stands around the motor",
        {
            "limit_negative_mm": place("Place of the limit switch"),
            "limit_positive_mm": place("Place of the limit switch"),
            "home_from_mm": place("The home switch is on from here"),
            "home_to_mm": place("The home switch is on up to here"),
            "rated_torque_nm": parts.number("Rated torque", 1e-9, 1e6),
            "rated_current_a": parts.number("Rated current", 1e-9, 1e6),
            "overload_s": parts.number("How long full voltage may last", 0, 1e6),
            "friction_volts": parts.number("Coulomb friction, as voltage", 0, 1e6, 0),
            "brake_volts": parts.number("Friction of the holding brake, as voltage", 1e-9, 1e6),
        },
        more={"dependencies": {"home_from_mm": ["home_to_mm"], "home_to_mm": ["home_from_mm"]}},
    )
