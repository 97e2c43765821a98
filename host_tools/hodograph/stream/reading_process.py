# SPDX-License-Identifier: MIT
"""Reads and fits a toolpath in a process of its own, so that the feed is planned on another core meanwhile. Used by
stream/plan. Starts a process that reads the file, and kills it in the end; stdin is read in the calling process.

What comes out is what StreamReader gives, in the same order and with the same bits. The process is a copy of this one
(fork): it begins at once, and holds nothing of its own before it reads. It ends with its reader: the system kills it
when the thread that began it ends, and its next write fails when the pipe between the two is closed. It is ahead by
what the pipe holds, and by one part of the path.
"""

from __future__ import annotations

import ctypes
import multiprocessing
import multiprocessing.context
import os
import pickle
import signal
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing.connection import Connection
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from ..errors import HodographError
from ..names import STANDARD_INPUT
from ..toolpath.moves import Command
from .geometry import Block
from .reading import StreamReader, StreamSection

_Point = NDArray[np.float64]
_ENDING = (signal.SIGTERM, signal.SIGHUP)
_PR_SET_PDEATHSIG = 1
"""Of prctl(2)."""


@dataclass(frozen=True, eq=False)
class _SectionEnd:
    """After the last block of a section: where the next one starts."""

    next_start: _Point | None


@dataclass(frozen=True, eq=False)
class _FileEnd:
    """After the last section."""

    after: tuple[Command, ...]


@dataclass(frozen=True, eq=False)
class _Failure:
    """An error by its parts: not all of them can be made of their message alone."""

    kind: type[HodographError]
    text: str
    more: dict[str, Any]

    def error(self) -> HodographError:
        """The error."""
        made = self.kind.__new__(self.kind, self.text)
        made.args = (self.text,)
        made.__dict__.update(self.more)
        return made


_Item = StreamSection | Block | _SectionEnd | _FileEnd | _Failure


class ParallelReader:
    """As StreamReader, whose file is read by another process. Standard input is read here."""

    def __init__(self, reader: StreamReader) -> None:
        self._reader = reader
        self.after: tuple[Command, ...] = ()

    def sections(self) -> Iterator[StreamSection]:
        """The sections, each to be read to its end first. Raises what StreamReader raises, and HodographError: the
        process has ended.
        """
        if str(self._reader.file) == STANDARD_INPUT:
            yield from self._reader.sections()
            self.after = self._reader.after
            return
        source, sink = multiprocessing.get_context("fork").Pipe(duplex=False)
        process = _started(self._reader, source, sink)
        try:
            item = self._item(source)
            while isinstance(item, StreamSection):
                end: list[_SectionEnd] = []
                yield replace(
                    item, blocks=self._blocks(source, end), next_start=partial(_start, end)
                )
                item = self._item(source)
            assert isinstance(item, _FileEnd)
            self.after = item.after
        finally:
            source.close()
            process.kill()
            process.join()

    def _blocks(self, source: Connection, end: list[_SectionEnd]) -> Iterator[Block]:
        item = self._item(source)
        while isinstance(item, Block):
            yield item
            item = self._item(source)
        assert isinstance(item, _SectionEnd)
        end.append(item)

    def _item(self, source: Connection) -> _Item:
        try:
            item, notes = pickle.loads(source.recv_bytes())
        except (EOFError, OSError):  # also in the middle of a message
            raise HodographError(
                f"{self._reader.file}: the process that reads it has ended: start the job again"
            ) from None
        self._reader.notes.extend(notes)
        if isinstance(item, _Failure):
            raise item.error()
        return item  # type: ignore[no-any-return]


def _start(end: list[_SectionEnd]) -> _Point | None:
    return end[0].next_start if end else None


def _unknown() -> None:
    """Stands for the start of the next section on the way from one process to the other."""


def _started(
    reader: StreamReader, source: Connection, sink: Connection
) -> multiprocessing.context.ForkProcess:
    """The process that reads. Ctrl-C is for this one alone: the signal stays blocked there. The others are blocked
    until the handlers of this one have been removed there.
    """
    process = multiprocessing.get_context("fork").Process(
        target=_read, args=(reader, source, sink), daemon=True
    )
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT, *_ENDING))
    try:
        process.start()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, blocked)
    sink.close()
    return process


def _read(reader: StreamReader, source: Connection, sink: Connection) -> NoReturn:
    """Sends all items of a reader."""
    _end_with_parent()
    for number in _ENDING:
        if callable(signal.getsignal(number)):
            signal.signal(number, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _ENDING)
    source.close()
    known = len(reader.notes)

    def send(item: _Item) -> None:
        nonlocal known
        message = pickle.dumps((item, reader.notes[known:]), pickle.HIGHEST_PROTOCOL)
        known = len(reader.notes)
        try:
            sink.send_bytes(message)
        except OSError:  # the reader has ended
            os._exit(0)

    try:
        for item in _items(reader):
            send(item)
    except HodographError as error:
        send(_Failure(type(error), str(error), vars(error)))
    os._exit(0)


def _end_with_parent() -> None:
    """Has the system kill this process when its parent dies, where it can: a child that lives on would keep the lock of
    the journal.
    """
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)


def _items(reader: StreamReader) -> Iterator[_Item]:
    for section in reader.sections():
        yield replace(section, blocks=iter(()), next_start=_unknown)
        yield from section.blocks
        yield _SectionEnd(section.next_start())
    yield _FileEnd(reader.after)
