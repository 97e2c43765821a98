# SPDX-License-Identifier: MIT
"""The campaign file: which runs to make. Keys and their meaning: docs/guides/campaigns.md. Used by campaign/,
cli/campaign_command and schemas/campaign_file. Reads the campaign file, the files that it names, and the compiled
module.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from .. import __version__
from ..config import Machine, PathFile, load_machine, load_path_file, read_toml
from ..config.axis_table import Feedforward
from ..config.table import Table
from ..errors import InputError
from ..faults.scenario import inline_scenario, load_scenario
from ..feed.request import GREATEST_FEED_MM_S, LEAST_FEED_MM_S, PROFILES
from ..names import INTERPOLATIONS, KERNELS
from ..native import native_file
from ..pipeline import Pipeline
from .fault_rules import Fault
from .run_settings import Design, Gains, Plant, gains_of
from .variation import read_variations

NO_FAULT = Fault("none")


def read_faults(root: Table, raw: Mapping[str, Any], plants: Sequence[Plant]) -> tuple[Fault, ...]:
    """The faults in the order of the file; empty: none. Raises InputError, also if a machine cannot have a rule."""
    if not root.has("faults"):
        return (NO_FAULT,)
    found: list[Fault] = []
    tables = root.tables("faults", ("name", "scenario", "rules", "random"))
    for table, data in zip(tables, raw["faults"], strict=True):
        fault = _fault(table, data)
        if fault.name in [other.name for other in found]:
            raise table.error("name", f'"{fault.name}" is there twice')
        _try(table, fault, plants)
        found.append(fault)
    return tuple(found)


def _fault(table: Table, data: Mapping[str, Any]) -> Fault:
    name = table.text("name")
    if table.has("scenario"):
        if table.has("rules") or table.has("random"):
            raise table.error("scenario", "is given together with rules: keep one of the two")
        return Fault(name, load_scenario(table.present("scenario")))
    if table.has("random") and not table.has("rules"):
        raise table.error("random", "is given without rules that use it: add rules, or take it out")
    return Fault(name, inline_scenario(table, data, name)) if table.has("rules") else Fault(name)


def _try(table: Table, fault: Fault, plants: Sequence[Plant]) -> None:
    if fault.scenario is not None and fault.scenario.action != "none":
        raise table.error(
            "scenario", "has an action of the host, which needs a bus: use `hodograph faults`"
        )
    for plant in plants:
        try:
            fault.rules(0, 0, plant.nodes, plant.period_us)
        except InputError as error:
            key = "scenario" if table.has("scenario") else "rules"
            raise table.error(key, str(error).removeprefix("rule ")) from None


_PDFF = ("k_pp_rad_s_mm", "k_pv_nm_s_rad", "k_iv_per_s", "k_pf_rad_mm", "k_vf")
_FEED = tuple(field.name for field in fields(Feedforward))
AS_GIVEN = Gains("own")
"""The gains of a file without [[gains]]: the machine's own."""


def read_gains(root: Table, count: int) -> tuple[Gains, ...]:
    """The gains in the order of the file, for machines with so many path axes. Raises InputError."""
    if not root.has("gains"):
        return (AS_GIVEN,)
    tables = root.tables("gains", ("name", "machine", *_PDFF, "feedforward", "interpolation"))
    found: list[Gains] = []
    for table in tables:
        gains = _gains(table, count)
        if gains.name in [other.name for other in found]:
            raise table.error("name", f'"{gains.name}" is there twice')
        found.append(gains)
    return tuple(found)


def _gains(table: Table, count: int) -> Gains:
    changes: dict[str, tuple[float, ...]] = {}
    feed: dict[str, tuple[float, ...]] = {}
    interpolation = None
    if table.has("machine"):
        machine = load_machine(table.present("machine"))
        axes = machine.path_axes
        if len(axes) != count:
            raise table.error(
                "machine",
                f"names {machine.file} with {len(axes)} path axes, the machines of the paths have {count}",
            )
        drives = machine.models(axes)
        changes |= gains_of(drives, _PDFF)
        interpolation = tuple(drive.interpolation for drive in drives)
        feed |= {name: tuple(getattr(axis.feedforward, name) for axis in axes) for name in _FEED}
    changes |= {name: _for_axes(table, name, count, 1e6) for name in _PDFF if table.has(name)}
    forward = table.table("feedforward", _FEED, required=False)
    feed |= {name: _for_axes(forward, name, count, 32767) for name in _FEED if forward.has(name)}
    if table.has("interpolation"):
        interpolation = (table.choice("interpolation", INTERPOLATIONS),) * count
    return Gains(table.text("name"), tuple(changes.items()), tuple(feed.items()), interpolation)


def _for_axes(table: Table, name: str, count: int, high: float) -> tuple[float, ...]:
    """A number for all axes, or one for each."""
    found = table.optional_per_axis(name, count, low=0, high=high)
    assert found is not None, "the table has it"
    return found


GREATEST_SAMPLES = 10_000_000
GREATEST_RUNS = 10_000_000
_ROOT = (
    *("text", "paths", "machine", "kernel", "profiles", "feeds_mm_s", "samples", "seed"),
    *("gains", "faults", "vary"),
)


@dataclass(frozen=True)
class Source:
    """A path and the machine to run it on."""

    path: PathFile
    machine: Machine

    def pipeline(self, profile: str | None, feed_mm_s: float | None) -> Pipeline:
        """The pipeline to a program with another profile or feed than that of the file (None: that of the file)."""
        feed = Pipeline(self.path).feed
        feed = replace(
            feed,
            profile=profile or feed.profile,
            nominal_mm_s=feed_mm_s or feed.nominal_mm_s,
        )
        return Pipeline(replace(self.path, feed=feed), self.machine)


@dataclass(frozen=True)
class Campaign:
    """A campaign file, read and checked."""

    file: Path
    text: str
    sources: tuple[Source, ...]
    design: Design
    fingerprint: str
    """Hash of everything that the results depend on: the design, the paths and machines, and Hodograph itself."""


def load_campaign(file: Path) -> Campaign:
    """The campaign that a TOML file describes, with the files it names; raises InputError."""
    raw = read_toml(file)
    root = Table(file, "", raw, _ROOT)
    sources = _sources(root, raw)
    kernel = root.choice("kernel", KERNELS) if root.has("kernel") else None
    plants = tuple(_plant(source.machine, kernel) for source in sources)
    axes = _axes(root, sources)
    design = Design(
        names=_distinct_names([source.path for source in sources]),
        axes=axes,
        plants=plants,
        profiles=_profiles(root, raw),
        feeds_mm_s=_feeds(root, raw),
        gains=read_gains(root, len(axes)),
        faults=read_faults(root, raw, plants),
        variations=read_variations(root, raw, axes),
        samples=root.integer("samples", 1, low=1, high=GREATEST_SAMPLES),
        seed=root.integer("seed", 0, low=0, high=2**31),
    )
    if design.total > GREATEST_RUNS:
        raise InputError(
            f"{file}: makes {design.total} runs, more than {GREATEST_RUNS}: split it, or take fewer samples"
        )
    _check_samples(root, design)
    fingerprint = _fingerprint(design, sources)
    return Campaign(file, root.text("text", file.stem), sources, design, fingerprint)


def _fingerprint(design: Design, sources: Sequence[Source]) -> str:
    digest = hashlib.sha256(f"{__version__} {design!r}".encode())
    digest.update(native_file().read_bytes())
    for source in sources:
        digest.update(source.path.file.read_bytes())
        digest.update(repr(replace(source.machine, file=Path())).encode())
    return digest.hexdigest()


def _sources(root: Table, raw: Mapping[str, Any]) -> tuple[Source, ...]:
    machine = load_machine(root.present("machine")) if root.has("machine") else None
    found = []
    for name in _list(root, raw, "paths", '["path.toml"]'):
        one = Table(root.file, "", {"paths": name}, ("paths",))
        path = load_path_file(one.present("paths"))
        if path.turns_alone:
            raise one.error(
                "paths",
                f"names {path.file}, which moves rotary axes alone: a campaign takes paths of x, y and z",
            )
        pipeline = Pipeline(path, machine)
        pipeline.feed  # noqa: B018  (says what is missing)
        found.append(Source(path, pipeline.machine))
    return tuple(found)


def _plant(machine: Machine, kernel: str | None) -> Plant:
    axes = machine.path_axes
    return Plant(
        drives=machine.models(axes),
        feedforward=tuple(axis.feedforward for axis in axes),
        nodes=tuple(axis.node for axis in axes),
        kernel=kernel or machine.kernel,
        counts_per_unit=machine.path_counts,
        period_us=machine.period_us,
    )


def _axes(root: Table, sources: Sequence[Source]) -> tuple[str, ...]:
    """Names of the axes on the path, of each machine. Raises InputError: they differ."""
    first, *others = (source.machine.path_names for source in sources)
    for names in others:
        if names != first:
            raise root.error(
                "paths",
                f"run on machines with the path axes {', '.join(first)} and {', '.join(names)}: make a campaign of "
                "each, or name a machine",
            )
    return first


def _distinct_names(paths: Sequence[PathFile]) -> tuple[str, ...]:
    """File names without ending; where two are the same, with their folders."""
    names = [path.name for path in paths]
    return tuple(
        name if names.count(name) == 1 else str(path.file.with_suffix(""))
        for name, path in zip(names, paths, strict=True)
    )


def _profiles(root: Table, raw: Mapping[str, Any]) -> tuple[str | None, ...]:
    if not root.has("profiles"):
        return (None,)
    values = _list(root, raw, "profiles", f'["{PROFILES[0]}"]')
    tables = [Table(root.file, "", {"profiles": value}, ("profiles",)) for value in values]
    return tuple(table.choice("profiles", PROFILES) for table in tables)


def _feeds(root: Table, raw: Mapping[str, Any]) -> tuple[float | None, ...]:
    if not root.has("feeds_mm_s"):
        return (None,)
    values = _list(root, raw, "feeds_mm_s", "[50, 100]")
    tables = [Table(root.file, "", {"feeds_mm_s": value}, ("feeds_mm_s",)) for value in values]
    return tuple(
        table.number("feeds_mm_s", low=LEAST_FEED_MM_S, high=GREATEST_FEED_MM_S) for table in tables
    )


def _list(root: Table, raw: Mapping[str, Any], key: str, example: str) -> list[Any]:
    if key not in raw:
        raise root.error(key, f"is missing: add {key} = {example}")
    values = raw[key]
    if not isinstance(values, list) or not values:
        raise root.error(key, f"must be a list such as {example}")
    for value in values:
        if values.count(value) > 1:
            raise root.error(key, f"names {value} twice")
    return values


def _check_samples(root: Table, design: Design) -> None:
    """Raises InputError: several samples would be the same run, or a distribution has one draw."""
    random = [v for v in design.variations if not v.is_grid]
    drawn = any(f.scenario is not None and f.scenario.ranges for f in design.faults)
    if design.samples > 1 and not random and not drawn:
        raise root.error(
            "samples",
            f"is {design.samples}, but nothing is drawn: add [vary.FIGURE] with uniform or normal",
        )
    if random and not root.has("samples"):
        raise root.error("samples", f"is missing, and {random[0].figure} is drawn: say how often")
