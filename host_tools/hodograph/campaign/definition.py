# SPDX-License-Identifier: MIT
"""The campaign file: which runs to make. Keys and their meaning: docs/guides/campaigns.md."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from .. import __version__
from ..config import Machine, PathFile, load_machine, load_path_file, read_toml
from ..config.table import Table
from ..errors import InputError
from ..feed.request import GREATEST_FEED_MM_S, LEAST_FEED_MM_S, PROFILES
from ..names import KERNELS
from ..native import native_file
from ..pipeline import Pipeline
from .design import Design, Plant
from .fault_table import read_faults
from .gain_table import read_gains
from .variation_table import read_variations

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

    def chain(self, profile: str | None, feed_mm_s: float | None) -> Pipeline:
        """The steps to a program, with another profile or feed than the file asks for (None: the file's)."""
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
    """Of all that the results depend on: the design, the paths and machines, and Hodograph itself."""


def load_campaign(file: Path) -> Campaign:
    """The campaign that a TOML file describes, with the files it names; raises InputError."""
    raw = read_toml(file)
    root = Table(file, "", raw, _ROOT)
    sources = _sources(root, raw)
    kernel = root.choice("kernel", KERNELS) if root.has("kernel") else None
    plants = tuple(_plant(source.machine, kernel) for source in sources)
    design = Design(
        names=_distinct_names([source.path for source in sources]),
        plants=plants,
        profiles=_profiles(root, raw),
        feeds_mm_s=_feeds(root, raw),
        gains=read_gains(root),
        faults=read_faults(root, raw, plants),
        variations=read_variations(root, raw),
        samples=root.integer("samples", 1, low=1, high=GREATEST_SAMPLES),
        seed=root.integer("seed", 0, low=0, high=2**31),
    )
    if design.total > GREATEST_RUNS:
        raise InputError(
            f"{file}: makes {design.total} runs, more than {GREATEST_RUNS}: split it, or take fewer samples"
        )
    _check_samples(root, design)
    told = _fingerprint(design, sources)
    return Campaign(file, root.text("text", file.stem), sources, design, told)


def _fingerprint(design: Design, sources: Sequence[Source]) -> str:
    told = hashlib.sha256(f"{__version__} {design!r}".encode())
    told.update(native_file().read_bytes())
    for source in sources:
        told.update(source.path.file.read_bytes())
        told.update(repr(replace(source.machine, file=Path())).encode())
    return told.hexdigest()


def _sources(root: Table, raw: Mapping[str, Any]) -> tuple[Source, ...]:
    machine = load_machine(root.present("machine")) if root.has("machine") else None
    found = []
    for name in _list(root, raw, "paths", '["path.toml"]'):
        one = Table(root.file, "", {"paths": name}, ("paths",))
        path = load_path_file(one.present("paths"))
        chain = Pipeline(path, machine)
        chain.feed  # noqa: B018  (says what is missing)
        found.append(Source(path, chain.machine))
    return tuple(found)


def _plant(machine: Machine, kernel: str | None) -> Plant:
    x, y = machine.plane
    drives = machine.models(machine.plane)
    return Plant(
        drives=(drives[0], drives[1]),
        feedforward=(x.feedforward, y.feedforward),
        nodes=(x.node, y.node),
        kernel=kernel or machine.kernel,
        counts_per_mm=machine.counts_per_mm,
        period_us=machine.period_us,
    )


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
    """Several samples of which each is the same run are a mistake, and so is one draw of a distribution."""
    random = [v for v in design.variations if not v.is_grid]
    drawn = any(f.scenario is not None and f.scenario.ranges for f in design.faults)
    if design.samples > 1 and not random and not drawn:
        raise root.error(
            "samples",
            f"is {design.samples}, but nothing is drawn: add [vary.FIGURE] with uniform or normal",
        )
    if random and not root.has("samples"):
        raise root.error("samples", f"is missing, and {random[0].figure} is drawn: say how often")
