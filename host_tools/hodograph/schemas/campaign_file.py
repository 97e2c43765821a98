# SPDX-License-Identifier: MIT
"""The JSON schemas of campaign files and fault scenarios. Used by `schema` of this package. No I/O."""

from __future__ import annotations

from ..campaign.definition import GREATEST_SAMPLES
from ..campaign.variation import FIGURES, GRIDS, KINDS
from ..faults.scenario import ACTIONS, NEEDED, NO_LIMIT
from ..feed.request import (
    GREATEST_FEED_MM_S,
    LEAST_FEED_MM_S,
    PROFILES,
)
from ..names import INTERPOLATIONS, KERNELS
from . import parts
from .parts import Schema


def campaign_file() -> Schema:
    """The schema of a campaign file, without $schema."""
    pdff = ("k_pp_rad_s_mm", "k_pv_nm_s_rad", "k_iv_per_s", "k_pf_rad_mm", "k_vf")
    forward = ("velocity", "torque_permille_s2_m", "torque_permille_s_m")
    gains = parts.table(
        "Gains to try",
        {
            "name": parts.text("For the table of results"),
            "machine": parts.text("Machine file with these gains"),
            **{key: parts.number_or_vector("For all axes, or each", 2, 6, 0, 1e6) for key in pdff},
            "feedforward": parts.table(
                "As of [[axis]] of a machine file",
                {
                    key: parts.number_or_vector("For all axes, or each", 2, 6, 0, 32767)
                    for key in forward
                },
            ),
            "interpolation": parts.choice("Of setpoints in the drives", INTERPOLATIONS),
        },
        ("name",),
    )
    faults = parts.table(
        "A fault to try; without rules and scenario: none",
        {
            "name": parts.text("For the table of results"),
            "scenario": parts.text("Scenario file"),
            "rules": _rules(),
            "random": _random(),
        },
        ("name",),
        {
            "allOf": [
                {"not": {"required": ["scenario", "rules"]}},
                parts.only_with(("random",), {"required": ["rules"]}),
            ]
        },
    )
    return parts.table(
        "A campaign file of Hodograph: many simulated runs",
        {
            "text": parts.text("Title of the report"),
            "paths": parts.list_of("Path files", parts.text("Path file"), distinct=True),
            "machine": parts.text("Machine file in place of the paths' own"),
            "kernel": parts.choice("Number kernel in place of the machines' own", KERNELS),
            "profiles": parts.list_of(
                "Feed profiles to try", {"enum": list(PROFILES)}, distinct=True
            ),
            "feeds_mm_s": parts.list_of(
                "Feeds to try",
                {"type": "number", "minimum": LEAST_FEED_MM_S, "maximum": GREATEST_FEED_MM_S},
                distinct=True,
            ),
            "samples": parts.integer("Draws of everything random", 1, GREATEST_SAMPLES, 1),
            "seed": parts.integer("Of the random draws", 0, 2**31, 0),
            "gains": parts.list_of("Gains to try", gains),
            "faults": parts.list_of("Faults to try", faults),
            "vary": parts.table(
                "Figures of the drives that vary", {key: _vary(key) for key in FIGURES}
            ),
        },
        ("paths",),
        {"title": "Campaign file"},
    )


def _vary(figure: str) -> Schema:
    numbers: Schema = {"type": "number", "minimum": -1e9, "maximum": 1e9}
    kinds = {
        kind: parts.list_of("Each in turn", numbers, distinct=True)
        if kind in GRIDS
        else parts.list_of("Two numbers of the distribution", numbers, 2, 2)
        for kind in KINDS
    }
    return parts.table(
        f"How {figure} varies",
        kinds | {"axis": parts.text('The name of one axis, "all" alike, or "each" by itself')},
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


def scenario_file() -> Schema:
    """The schema of a fault scenario, without $schema."""
    limits = {
        key: parts.integer(text, 0, NO_LIMIT)
        for key, text in (
            ("within_ticks", "From the first injection to the fault"),
            ("within_ms", "The same in wall time"),
            ("rest_ticks", "From the fault until the axes are at rest"),
            ("rest_ms", "The same in wall time"),
            ("recover_ms", "From the reset until the drives are configured anew"),
        )
    }
    expect = parts.table(
        "What must come of it",
        limits
        | {
            "codes": {
                "type": "array",
                "items": {"type": "integer"},
                "description": "Fault codes of which one must be raised; none: no fault",
            },
            "may": parts.flag("The fault is allowed, not required", False),
            "same_encoders": parts.flag("Encoder values are those without the fault", True),
            "unseen": parts.flag("A drive may be silent as its axis comes to rest", False),
            "on_path": parts.flag("The setpoints come to rest on the path", False),
        },
    )
    return parts.table(
        "A fault scenario of Hodograph",
        {
            "text": parts.text("What happens"),
            "path": parts.text("Path file, relative to this file"),
            "rules": _rules(),
            "random": _random(),
            "host": parts.table(
                "What the host does", {"action": parts.choice("At tick {at}", ACTIONS, "none")}
            ),
            "expect": expect,
        },
        ("text", "path"),
        {"title": "Fault scenario", "allOf": [_with_names(*one) for one in NEEDED.items()]},
    )


def _with_names(action: str, names: tuple[str, ...]) -> Schema:
    """The condition that an action has the names that it takes from [random]."""
    host = {"properties": {"action": {"const": action}}, "required": ["action"]}
    random_ = {"required": list(names)}
    return {
        "if": {"properties": {"host": host}, "required": ["host"]},
        "then": {"properties": {"random": random_}, "required": ["random"]},
    }
