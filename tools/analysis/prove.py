#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""prove.py [OPTION...] [NAME...]: runs the proofs of tests/proofs, or those named; --help has the options.

Run by `make proofs`. Starts the provers; writes below --build and to the cache folder.

A proof is a C file with a first comment that says, line by line, `prover: eva` or `prover: cbmc`, the functions whose
contracts it `assumes:` (Eva) or `replaces: function:stub` (CBMC), those that it `shows:`, more `options:`, what stands
`instead:` of something equal that the prover cannot follow, and its `mutant:`s, both `FILE: OLD => NEW`. It counts as
proven if the prover reports no alarm and reaches the proof's end, reached(), for machines of 64 and of 32 bits. In each
mutant, a copy of the firmware with that mistake, the prover must find an alarm: so no proof is empty. Another proof has
to show what a proof assumes, or argued.txt has it, with the argument and a test; --contracts prints that table and runs
nothing. The last line is `N passed, N failed`, including mutants. Exit status 1 if one failed.

A run that ended as it should is kept in the cache (testing/cache.py) under the hash of the proof, the files that it
includes after its changes, the provers, their options and this program; as long as these are the same it is taken from
there. --no-stamps runs everything.
"""

from __future__ import annotations

import argparse
import json
import re
import resource
import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

from testing.cache import Stamps, content, digest, tree  # noqa: E402

PROOFS = ROOT / "tests" / "proofs"
LIMIT_S = 300  # seconds of processor time for one run of a prover
PATIENCE = (
    40  # times that, of wall time: only what waits for nothing gets there, however busy the machine
)
MACHDEP = {64: "gcc_x86_64", 32: "gcc_x86_32"}  # Eva's machines by bits of a pointer
PICOLIBC = "/usr/lib/picolibc/arm-none-eabi/picolibc.specs"  # what the firmware is built with
PLAIN = (
    f"--specs={PICOLIBC}",
    "-U__arm__",
    "-D__IEEE_LITTLE_ENDIAN",
)  # no assembler: CBMC does not read it
EVA = (
    *("-eva", "-eva-no-results", "-eva-msg-key=-initial-state,-final-states"),
    *("-eva-slevel", "200", "-eva-split-limit", "200", "-eva-auto-loop-unroll", "20"),
    *("-eva-equality-through-calls", "all", "-eva-split-return", "full"),
)


class BadProof(Exception):
    """A proof's first comment says something else than what prove.py knows."""


@dataclass
class Proof:
    """The first comment of a proof, parsed."""

    name: str
    prover: str = ""
    assumes: list[str] = field(default_factory=list)
    replaces: list[str] = field(default_factory=list)
    shows: list[str] = field(default_factory=list)
    options: list[str] = field(default_factory=list)
    mutants: list[tuple[str, str, str]] = field(default_factory=list)
    instead: list[tuple[str, str, str]] = field(default_factory=list)


@dataclass
class Verdict:
    """How one run of a prover ended."""

    proven: bool
    doubt: bool  # the prover found something it cannot exclude; neither: it could not do its work
    why: str
    seconds: float


def read_proof(path: Path) -> Proof:
    """Reads the first comment but one (the first names the licence)."""
    proof = Proof(path.stem)
    for key, value in re.findall(r"^ \* (\w+): (.+)$", path.read_text(), re.MULTILINE):
        if key == "prover":
            proof.prover = value
        elif key in ("mutant", "instead"):
            found = re.fullmatch(r"([\w/.]+): (.+?) =>(?: (.*))?", value)
            if found is None:
                raise BadProof(f"{path}: {key} is not FILE: OLD => NEW: {value}")
            list_ = proof.mutants if key == "mutant" else proof.instead
            list_.append((found[1], found[2], found[3] or ""))
        elif key in ("assumes", "replaces", "shows", "options"):
            getattr(proof, key).extend(value.split())
    if proof.prover not in ("eva", "cbmc") or not proof.mutants:
        raise BadProof(f"{path}: needs a prover, eva or cbmc, and at least one mutant")
    return proof


def stale_changes(proof: Proof, firmware: Path) -> list[str]:
    """Changes of a proof (`mutant:`, `instead:`) whose text is no longer in its file: a line for each."""
    return [
        f"{proof.name}: {file} has no `{old}` to change"
        for file, old, _ in [*proof.instead, *proof.mutants]
        if not (firmware / file).is_file() or old not in (firmware / file).read_text()
    ]


def _call(command: list[str]) -> tuple[int, str]:
    limited = ["prlimit", f"--cpu={LIMIT_S}", *command]
    try:
        done = subprocess.run(
            limited,
            capture_output=True,
            text=True,
            timeout=PATIENCE * LIMIT_S,
            check=False,
            cwd=ROOT,
        )
    except subprocess.TimeoutExpired:
        return -1, f"prove.py: no answer within {PATIENCE * LIMIT_S} s"
    if -done.returncode in (signal.SIGXCPU, signal.SIGKILL):
        return -1, f"prove.py: no answer within {LIMIT_S} s of processor time"
    return done.returncode, done.stdout + done.stderr


class CannotTell(Exception):
    """A prover gave up, or did not reach the end of a proof."""


def _undeclared(proof: Proof, out: str) -> list[str]:
    """Functions that Eva took a contract for though the proof does not say so."""
    used = set(re.findall(r"using specification for function (\w+)", out))
    own = {name for name in used if re.match("Frama_C_|__|mem|prove$", name)}
    return sorted(used - own - set(proof.assumes))


def _eva(proof: Proof, firmware: Path, bin_: Path, work: Path, bits: int) -> str:
    specified = ["-eva-use-spec", ",".join(proof.assumes)] if proof.assumes else []
    if not work.parent.name.isdigit():  # a mutant: one alarm is enough
        specified += ["-eva-stop-at-nth-alarm", "1"]
    source = PROOFS / f"{proof.name}.c"
    status, out = _call(
        [
            *(str(bin_ / "frama-c"), f"-cpp-extra-args=-I{firmware} -I{PROOFS}", str(source)),
            *("-machdep", MACHDEP[bits], *EVA, *specified, *proof.options),
        ]
    )
    doubts = re.findall(r"^\[eva:alarm\] (.+?)\s*$\n(?:  )?(.*)$", out, re.MULTILINE)
    if doubts:
        return f"{len(doubts)} alarms, the first: {doubts[0][0]} {doubts[0][1]}"
    if status != 0 or "  0 alarms generated" not in out:
        raise CannotTell(out[-1500:])
    if re.search(r"[1-9]\d* (unknown|invalid)", out):
        return "a contract was not proven: " + out[-900:]
    if "Frama_C_show_each_reached" not in out:
        raise CannotTell("its end was not reached")
    if undeclared := _undeclared(proof, out):
        return f"takes for granted, and does not say so: {' '.join(undeclared)}"
    return ""


def _cbmc(proof: Proof, firmware: Path, bin_: Path, work: Path, bits: int) -> str:
    whole, replaced, source = work / "whole.gb", work / "replaced.gb", PROOFS / f"{proof.name}.c"
    paths = [f"-I{firmware}", f"-I{PROOFS}"]
    compile_ = [str(bin_ / "goto-cc"), "-o", str(whole), "--function", "harness"]
    steps = [[*compile_, *paths, str(source)]]
    if bits == 32:  # with the headers of a 32-bit C library
        one = work / "whole.i"
        steps = [
            ["arm-none-eabi-gcc", *PLAIN, "-E", *paths, "-o", str(one), str(source)],
            [*compile_, "-m32", str(one)],
        ]
    calls = [word for pair in proof.replaces for word in ("--replace-calls", pair)]
    steps.append([str(bin_ / "goto-instrument"), *calls, str(whole), str(replaced)])
    for step in steps:
        status, out = _call(step)
        if status != 0:
            raise CannotTell(out[-1500:])
    _, out = _call([str(bin_ / "cbmc"), str(replaced), "--slice-formula", *proof.options])
    failed = re.findall(r"^\[.*\] (.*): FAILURE$", out, re.MULTILINE)
    others = [line for line in failed if not line.endswith(" reached")]
    if others:
        return f"{len(others)} failed, the first: {others[0]}"
    if not failed:
        raise CannotTell("its end was not reached: " + out[-1500:])
    return ""


def run(proof: Proof, firmware: Path, bin_: Path, work: Path, bits: int) -> Verdict:
    """Runs the prover on one proof, with the firmware from a folder, for a machine of so many bits."""
    work.mkdir(parents=True, exist_ok=True)
    start = time.monotonic()
    try:
        why = (_eva if proof.prover == "eva" else _cbmc)(proof, firmware, bin_, work, bits)
        proven, doubt = why == "", why != ""
    except CannotTell as error:
        proven, doubt, why = False, False, str(error)
    return Verdict(proven, doubt, why, time.monotonic() - start)


def make_copy(changes: list[tuple[str, str, str]], work: Path) -> Path:
    """A copy of firmware/core with these changes; returns the folder to include from."""
    firmware = work / "firmware"
    shutil.rmtree(firmware, ignore_errors=True)
    shutil.copytree(ROOT / "firmware" / "core", firmware / "core")
    for file, old, new in changes:
        text = (firmware / file).read_text()
        if old not in text:
            raise BadProof(f"{work}: {file} has no `{old}` to change")
        (firmware / file).write_text(text.replace(old, new, 1))
    return firmware


@dataclass
class Run:
    """A proof, or one of its mutants, for one machine."""

    proof: Proof
    bits: int
    mutant: int | None = None

    @property
    def changes(self) -> list[tuple[str, str, str]]:
        """What is changed in the copy of the firmware."""
        proof = self.proof
        return (
            proof.instead if self.mutant is None else [*proof.instead, proof.mutants[self.mutant]]
        )

    @property
    def work(self) -> Path:
        """Folder of its own, below that of the proofs."""
        folder = Path(str(self.bits), self.proof.name)
        return folder if self.mutant is None else folder / str(self.mutant)


def included(proof: Proof, firmware: Path) -> list[Path]:
    """What the compiler includes for a proof, by its own word: as each of the two provers names itself."""
    files: set[Path] = set()
    for names_itself in ("-D__FRAMAC__", "-U__FRAMAC__"):
        command = ["gcc", "-MM", "-MG", names_itself, f"-I{firmware}", f"-I{PROOFS}"]
        done = subprocess.run(
            [*command, str(PROOFS / f"{proof.name}.c")], capture_output=True, text=True, check=False
        )
        if done.returncode != 0:
            raise BadProof(f"{proof.name}: its includes cannot be found: {done.stderr[-500:]}")
        words = done.stdout.replace("\\\n", " ").split()[1:]
        files |= {Path(word) for word in words}
    return sorted(files)


def provers_digest(build: Path) -> str:
    """Digest of the provers themselves, the compilers that read headers for them, and this program."""
    versions = [
        subprocess.run([name, "--version"], capture_output=True, text=True, check=False).stdout
        for name in ("gcc", "arm-none-eabi-gcc")
    ]
    root = build / "provers" / "root"
    headers = tree(Path(PICOLIBC).parent / "include")
    return digest([tree(root), libraries(root), headers, content(Path(__file__)), *versions])


def libraries(root: Path) -> str:
    """Digests of the shared libraries that the provers bring along."""
    found = sorted(path for path in root.rglob("*.so*") if path.is_file())
    return digest(word for path in found for word in (path.name, content(path)))


def key_of(run_: Run, firmware: Path, provers: str) -> str:
    """Of all that the verdict of a run depends on."""
    proof = run_.proof
    words = [provers, proof.prover, str(run_.bits), str(run_.mutant), *EVA, *PLAIN, str(LIMIT_S)]
    words += [*proof.assumes, "|", *proof.replaces, "|", *proof.options]
    for path in included(proof, firmware):
        name = path.relative_to(firmware) if path.is_relative_to(firmware) else path.name
        words += [str(name), content(path)]
    changed = {file for file, _, _ in run_.changes}
    words += [word for file in sorted(changed) for word in (file, content(firmware / file))]
    return digest(words)


def _report(run_: Run, what: str, good: bool, verdict: Verdict, said: str) -> dict[str, object]:
    proof = run_.proof
    print(
        f"  {said:9} {verdict.seconds:6.1f} s  {proof.prover:4}  {run_.bits}  {proof.name}  {what}",
        flush=True,
    )
    if not good:
        print(f"    {verdict.why}", flush=True)
    seconds = round(verdict.seconds, 1)
    return {
        "proof": proof.name,
        "bits": run_.bits,
        "what": what,
        "good": good,
        "seconds": seconds,
    }


@dataclass
class Prover:
    """Runs proofs, or takes what they gave from the stamps."""

    build: Path
    stamps: Stamps
    provers: str  # provers_digest()

    def check(self, run_: Run) -> dict[str, object]:
        """The proof, or one of its mutants; as an entry of the JSON."""
        work = self.build / "proofs" / run_.work
        firmware = make_copy(run_.changes, work)
        key = key_of(run_, firmware, self.provers)
        kept = self.stamps.read(key)
        if kept is not None:
            return {**kept, "stamp": True}
        entry = self._prove(run_, firmware, work)
        if entry["good"] and key_of(run_, firmware, self.provers) == key:
            self.stamps.write(key, entry)
        return {**entry, "stamp": False}

    def _prove(self, run_: Run, firmware: Path, work: Path) -> dict[str, object]:
        proof = run_.proof
        verdict = run(proof, firmware, self.build / "provers" / "bin", work, run_.bits)
        if run_.mutant is None:
            good = verdict.proven
            return _report(run_, "", good, verdict, "proven" if good else "NOT")
        _, old, new = proof.mutants[run_.mutant]
        good = verdict.doubt
        return _report(
            run_, f"mutant: {old} => {new}", good, verdict, "found" if good else "MISSED"
        )


def read_argued() -> dict[str, str]:
    """Contracts that no prover shows: by function, the argument and its test."""
    lines = (PROOFS / "argued.txt").read_text().splitlines()
    pairs = (line.split(None, 1) for line in lines if line and not line.startswith("#"))
    return {name: how.strip() for name, how in pairs}


def contracts(proofs: list[Proof]) -> list[tuple[str, str, str]]:
    """Each function that a proof takes for granted, by which, and what shows it; BadProof when nothing does."""
    argued = read_argued()
    users: dict[str, list[str]] = {}
    for proof in proofs:
        for name in (*proof.assumes, *(pair.split(":")[0] for pair in proof.replaces)):
            users.setdefault(name, []).append(proof.name)
    table = []
    for name, assumed in sorted(users.items()):
        shown = [f"`{proof.name}`" for proof in proofs if name in proof.shows]
        shown += [argued[name]] if name in argued else []
        if not shown:
            raise BadProof(f"{assumed[0]} takes {name} for granted, which nothing shows")
        table.append((name, ", ".join(f"`{a}`" for a in assumed), "; ".join(shown)))
    if spare := sorted(set(argued) - set(users)):
        raise BadProof(f"argued.txt has what no proof takes for granted: {' '.join(spare)}")
    return table


def main() -> int:
    """Command line; see above."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="only these proofs")
    parser.add_argument("--build", type=Path, default=ROOT / "build")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--no-mutants", action="store_true", help="only the proofs themselves")
    parser.add_argument("--no-stamps", action="store_true", help="prove everything now")
    parser.add_argument("--contracts", action="store_true", help="what each takes for granted")
    options = parser.parse_args()
    build = options.build.resolve()
    try:
        everything = [read_proof(path) for path in sorted(PROOFS.glob("*.c"))]
        table = contracts(everything)
        if options.contracts:
            print("| function | taken for granted by | shown by |\n| --- | --- | --- |")
            print("\n".join(f"| `{name}` | {users} | {shown} |" for name, users, shown in table))
            return 0
        proofs = [read_proof(PROOFS / f"{name}.c") for name in options.names] or everything
        if stale := [line for proof in proofs for line in stale_changes(proof, ROOT / "firmware")]:
            raise BadProof("\n".join(stale))
        runs = [Run(proof, bits) for proof in proofs for bits in MACHDEP]
        if not options.no_mutants:
            runs += [Run(proof, 64, i) for proof in proofs for i in range(len(proof.mutants))]
        stamps = Stamps("proofs", used=not options.no_stamps)
        prover = Prover(build, stamps, provers_digest(build))
        with ThreadPoolExecutor(options.jobs) as pool:
            entries = list(pool.map(prover.check, runs))
        stamps.prune()
    except BadProof as error:
        print(f"prove.py: {error}", file=sys.stderr)
        return 1
    (build / "proofs.json").write_text(json.dumps(entries, indent=1) + "\n")
    bad = sum(not entry["good"] for entry in entries)
    cpu = resource.getrusage(resource.RUSAGE_CHILDREN)
    taken = sum(bool(entry["stamp"]) for entry in entries)
    print(
        f"proofs: {len(proofs)} files, {len(entries) - taken} runs of a prover now, {taken} taken from stamps, "
        f"{cpu.ru_utime + cpu.ru_stime:.0f} s of processor time"
    )
    print(f"{len(entries) - bad} passed, {bad} failed")
    return 1 if bad or not entries else 0


if __name__ == "__main__":
    sys.exit(main())
