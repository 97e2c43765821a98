# SPDX-License-Identifier: MIT
"""Planned chunks on the disk: bounded, given back as they are read, and what happens when the disk is full. Run by
pytest; starts threads and processes, and writes to temporary folders.
"""

from __future__ import annotations

import errno
import os
import time
from collections import namedtuple
from pathlib import Path

import pytest

from hodograph.config import load_machine
from hodograph.errors import InputError, RunError
from hodograph.stream import plan as plan_module
from hodograph.stream import store as store_module
from hodograph.stream.plan import JobFiles, JobPlan, Place
from hodograph.stream.store import ChunkStore
from hodograph.toolpath.files import ReadOptions

ROOT = Path(__file__).resolve().parents[3]
MILL = ROOT / "examples" / "machines" / "mill.toml"
PATIENCE_S = 100.0
CORNERS = "".join(f"G1 X{k % 2} Y{k}\n" for k in range(1, 9))
Usage = namedtuple("Usage", "total used free")


def _job(folder: Path) -> JobFiles:
    file = folder / "part.ngc"
    file.write_text(f"F6000\nG61\n{CORNERS}M2\n")
    return JobFiles((file,), load_machine(MILL), 0.01, ReadOptions())


def _read(plan: JobPlan) -> list[bytes]:
    """All chunks, each read as often as a sender does that finds no room in the controller at first."""
    found: list[bytes] = []
    while True:
        try:
            item, again = (plan.item(len(found), PATIENCE_S) for _ in range(2))
        except IndexError:
            return found
        assert item is not None
        assert again is not None
        assert again[1].encode() == item[1].encode()
        found.append(item[1].encode())


def test_chunks_come_back_in_order_and_their_files_go(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store_module, "PART_BYTES", 100)
    store = ChunkStore()
    chunks = [bytes([k]) * (30 + k) for k in range(40)]
    for chunk in chunks:
        assert store.put(chunk)
    many = len(store._parts)
    assert store.waiting == 40
    for k, chunk in enumerate(chunks):
        assert store.get(k) == chunk
        assert store.get(k) == chunk
    assert many > 8
    assert len(store._parts) == 1
    store.forget_all()
    assert store.get(39) == chunks[39]  # it may have to be sent again
    assert (store.waiting, store.waiting_bytes, store.byte_count) == (0, 0, sum(map(len, chunks)))


def test_nothing_of_a_plan_is_left_in_the_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(store_module.tempfile, "tempdir", None)
    store = ChunkStore()
    assert store.folder == tmp_path
    assert store.put(b"chunk")
    assert not list(tmp_path.iterdir())
    store.forget_all()


@pytest.mark.parametrize("bound", ["MOST_WAITING_BYTES", "_MOST_WAITING"])
def test_planning_waits_for_its_readers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, bound: str
) -> None:
    job = _job(tmp_path)
    with JobPlan(job, 1 << 20, 1, Place()) as plan:
        whole = _read(plan)
    monkeypatch.setattr(plan_module, bound, 1)
    most = 0
    with JobPlan(job, 1 << 20, 1, Place()) as plan:
        put = plan._store.put

        def watched(data: bytes) -> bool:
            nonlocal most
            most = max(most, plan._store.waiting + 1)
            return put(data)

        plan._store.put = watched  # type: ignore[method-assign]
        assert _read(plan) == whole
    assert (most, len(whole)) == (1, 8)


class FullDisk:
    """A disk that has no room for a new file `times` times."""

    def __init__(self, times: int) -> None:
        self.times, self.asked = times, 0

    def __call__(self, folder: Path) -> Usage:
        self.asked += 1
        return Usage(1 << 40, 0, 0 if self.asked <= self.times else 1 << 40)


def test_a_disk_that_is_full_at_once_is_refused_before_motion(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(store_module.shutil, "disk_usage", FullDisk(1000))
    with (
        JobPlan(_job(tmp_path), 1 << 20, 1, Place()) as plan,
        pytest.raises(RunError, match=r"the disk is full.*free 68 MiB, or set TMPDIR"),
    ):
        plan.item(0, PATIENCE_S)


def test_a_disk_that_fills_up_delays_the_plan(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each chunk needs a file of its own here, and the disk has room for one."""
    job = _job(tmp_path)
    with JobPlan(job, 1 << 20, 1, Place()) as plan:
        whole = _read(plan)
    monkeypatch.setattr(store_module, "PART_BYTES", 1)
    made = JobPlan(job, 1 << 20, 1, Place())
    refused = 0

    def usage(_: Path) -> Usage:
        nonlocal refused
        full = len(made._store._parts) >= 1
        refused += full
        return Usage(1 << 40, 0, 0 if full else 1 << 40)

    monkeypatch.setattr(store_module.shutil, "disk_usage", usage)
    with made as plan:
        while not refused:
            time.sleep(0.001)  # nothing is read before the disk is full
        assert _read(plan) == whole


def test_a_write_that_fails_midway_is_made_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    store, real, script = ChunkStore(), os.pwrite, [3, None, 100, 100]

    def pwrite(descriptor: int, data: bytes, at: int) -> int:
        step = script.pop(0)
        if step is None:
            raise OSError(errno.ENOSPC, "No space left on device")
        return real(descriptor, data[:step], at)

    monkeypatch.setattr(store_module.os, "pwrite", pwrite)
    assert not store.put(b"a chunk")
    assert store.count == 0
    assert store.put(b"a chunk")
    assert store.get(0) == b"a chunk"
    store.forget_all()


def test_a_folder_that_is_gone_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store = ChunkStore()
    store.folder = tmp_path / "none"
    with pytest.raises(RunError, match=r"none: the plan of the job cannot be kept there: No such"):
        store.put(b"chunk")


def test_a_file_that_changes_meanwhile_ends_the_job(tmp_path: Path) -> None:
    """Its end may have been read half written: nothing of what was planned since is sent."""
    job = _job(tmp_path)
    plan = JobPlan(job, 1 << 20, 1, Place())
    job.files[0].write_text(job.files[0].read_text() + "G1 X9\n")
    with plan, pytest.raises(InputError, match=r"part\.ngc: has been changed while"):
        plan.item(0, PATIENCE_S)


def test_a_plan_ends_while_its_input_is_silent(monkeypatch: pytest.MonkeyPatch) -> None:
    """Standard input that stays open in the middle of a line does not keep the command from its end."""
    monkeypatch.setattr(plan_module, "_INPUT_WAIT_S", 0.05)
    reader, writer = os.pipe()
    kept = os.dup(0)
    try:
        os.dup2(reader, 0)
        os.write(writer, b"F600\nG1 X")
        job = JobFiles((Path("-"),), load_machine(MILL), 0.01, ReadOptions())
        with JobPlan(job, 1 << 20, 1, Place()) as plan:
            assert plan.item(0, 0.0) is None
        assert plan._thread.is_alive()
        os.close(writer)
        plan._thread.join()
    finally:
        os.dup2(kept, 0)
        os.close(kept)
        os.close(reader)
