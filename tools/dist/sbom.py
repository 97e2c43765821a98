#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""sbom.py: the list of components of what is shipped (SBOM), as CycloneDX 1.6 in JSON: `make sbom`.

    sbom.py --build BUILD --tool CYCLONEDX_PY OUT

Run by `make sbom`. Starts cyclonedx-py; writes OUT and a temporary file.

cyclonedx-py reads BUILD/runtime: the Python packages with versions, licences and dependencies. The library and the
programs in C are added with their hashes; they are this project's own and contain no other code. The same tree gives
the same bytes.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from dist.library import ROOT, version


def own_component(file: Path, kind: str) -> dict[str, Any]:
    """A compiled file of this project."""
    name = file.name.partition(".so.")[0]
    return {
        "bom-ref": f"{name}@{version()}",
        "type": kind,
        "name": name,
        "version": version(),
        "hashes": [{"alg": "SHA-256", "content": hashlib.sha256(file.read_bytes()).hexdigest()}],
        "licenses": [{"license": {"id": "MIT"}}],
    }


def own_components(build: Path) -> list[dict[str, Any]]:
    """Library and programs."""
    library = own_component(build / f"library/libhodograph.so.{version()}", "library")
    programs = sorted((build / "bin").glob("hodograph-*"))
    return [library, *(own_component(program, "application") for program in programs)]


def make_sbom(build: Path, tool: Path) -> dict[str, Any]:
    """The document; raises CalledProcessError."""
    with tempfile.TemporaryDirectory(prefix="hodograph-sbom-") as folder:
        target = Path(folder, "sbom.json")
        words = [
            "environment",
            "--pyproject",
            str(ROOT / "pyproject.toml"),
            "--mc-type",
            "application",
        ]
        words += ["--spec-version", "1.6", "--output-reproducible", "--output-format", "JSON"]
        words += ["--output-file", str(target), str(build / "runtime/bin/python3")]
        subprocess.run([str(tool), *words], check=True)
        document: dict[str, Any] = json.loads(target.read_text(encoding="utf-8"))
    root = document["metadata"]["component"]
    root["version"] = version()
    own = own_components(build)
    document["components"] = [*document["components"], *own]
    for dependency in document["dependencies"]:
        if dependency["ref"] == root["bom-ref"]:
            refs = {*dependency.get("dependsOn", []), *(component["bom-ref"] for component in own)}
            dependency["dependsOn"] = sorted(refs)
    document["dependencies"] += [{"ref": component["bom-ref"]} for component in own]
    return document


def main() -> int:
    """Exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--build", type=Path, required=True)
    parser.add_argument("--tool", type=Path, required=True)
    parser.add_argument("out", type=Path)
    options = parser.parse_args()
    document = make_sbom(options.build, options.tool)
    options.out.mkdir(parents=True, exist_ok=True)
    target = options.out / f"hodograph-{version()}.cdx.json"
    target.write_text(json.dumps(document, indent=1, sort_keys=True) + "\n", encoding="utf-8")
    print(f"{target}  {len(document['components'])} components")
    return 0


if __name__ == "__main__":
    sys.exit(main())
