# SPDX-License-Identifier: MIT
"""Entry point: from the command line to an exit status; a traceback is printed only on request. Started by the shell
and by __main__. Changes signal handlers of the process, and prints errors to stderr.
"""

from __future__ import annotations

import argparse
import errno
import logging
import os
import signal
import sys
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from importlib import import_module
from types import FrameType

from ..errors import INTERRUPTED_EXIT_STATUS, HodographError, InputError
from .output import WANTED, complain
from .parser import make_parser
from .waiting import waiting

TERMINATED_EXIT_STATUS = 143
"""Exit status after SIGTERM (128 + SIGTERM)."""
HUNG_UP_EXIT_STATUS = 129
"""Exit status after SIGHUP (128 + SIGHUP)."""
_NO_SPACE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


_MODULES = {
    **dict.fromkeys(("init", "schema"), "start_commands"),
    **dict.fromkeys(("spline", "feed", "compile", "inspect", "simulate"), "path_commands"),
    **dict.fromkeys(("upload", "goto", "output", "rig"), "motion_commands"),
    "run": "run_command",
    "stream": "stream_command",
    **dict.fromkeys(("start", "stop", "hold", "resume", "override"), "bus_commands"),
    "completion": "completion",
    **dict.fromkeys(("scan", "check"), "commission_commands"),
    "import": "toolpath_commands",
    "demo": "demo_command",
    "latency": "latency_command",
    "verify": "verify_command",
    "status": "status_command",
    "record": "record_command",
    "replay": "replay_command",
    **dict.fromkeys(("configure", "home", "quick-stop", "reset"), "action_commands"),
    "campaign": "campaign_command",
    "dbc": "dbc_command",
    "tune": "tune_command",
    "identify": "identify_command",
    "faults": "faults_command",
    "monitor": "monitor_command",
    **dict.fromkeys(("report", "paper"), "report_commands"),
}
"""The module of each command; only that one is imported, since some take a second to load."""


_AWAITED = frozenset(
    (
        *(
            "spline",
            "feed",
            "compile",
            "inspect",
            "simulate",
            "import",
            "verify",
            "replay",
            "report",
        ),
        *("paper", "tune", "identify", "upload", "goto", "run", "stream", "campaign", "faults"),
        *("demo", "latency", "scan", "check", "configure"),
        *("home", "output", "start", "hold", "stop"),
    )
)
"""Commands whose running time a terminal shows; the others end at once, or at Ctrl-C."""


class Terminated(KeyboardInterrupt):
    """SIGTERM: the same cleanup as after Ctrl-C."""


class HungUp(KeyboardInterrupt):
    """SIGHUP: the terminal was closed; the same cleanup as after Ctrl-C."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs one command; returns the exit status."""
    debug = bool(os.environ.get("HODOGRAPH_DEBUG"))
    _open_closed_streams()
    try:
        options = make_parser().parse_args(arguments)
        debug = debug or options.debug
        with _on_signals():
            _run(options)
            sys.stdout.flush()
        return 0
    except HodographError as error:
        return _end(str(error), error.exit_status, debug)
    except Terminated:
        return _end("terminated", TERMINATED_EXIT_STATUS, debug)
    except HungUp:
        return _end("the terminal was closed", HUNG_UP_EXIT_STATUS, debug)
    except KeyboardInterrupt:
        return _end("interrupted", INTERRUPTED_EXIT_STATUS, debug)
    except BrokenPipeError:
        _drop_output()
        return 1
    except MemoryError:
        return _end("out of memory: the path or the run is too long for this machine", 1, debug)
    except OSError as error:
        if error.errno not in _NO_SPACE:
            return _internal_error(error, debug)
        if error.filename is None:
            _drop_output()
        message = f"{error.filename or 'output'}: cannot be written: {error.strerror}"
        return _end(message, InputError.exit_status, debug)
    except Exception as error:
        return _internal_error(error, debug)


def _internal_error(error: Exception, debug: bool) -> int:
    text = " ".join(str(error).split())
    return _end(
        f"internal error, please report it ({type(error).__name__}: {text}); HODOGRAPH_DEBUG=1 shows where",
        1,
        debug,
    )


def _open_closed_streams() -> None:
    """Replaces streams that the shell's >&- has closed; their output is lost."""
    if sys.stdout is None:
        sys.stdout = open(os.devnull, "w")  # noqa: SIM115  (as long as the process)
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w")  # noqa: SIM115


def _drop_output() -> None:
    """Discards buffered output that cannot be written; otherwise Python tries again at its end, with its own
    message.
    """
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _run(options: argparse.Namespace) -> None:
    command = options.command
    WANTED.notes = not options.quiet
    WANTED.progress = not (options.quiet or options.no_progress)
    # Matplotlib warns if a user has no folder for its cache, which does not matter for a report.
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    shown = WANTED.progress and command in _AWAITED
    with waiting(command) if shown else nullcontext():
        module = import_module(f"{__package__}.{_MODULES[command]}")
        module.COMMANDS[command](options)


def _end(message: str, status: int, debug: bool) -> int:
    if debug:
        traceback.print_exc()
    with suppress(OSError):  # the terminal may be gone
        complain(" ".join(message.split()))
    return status


@contextmanager
def _on_signals() -> Iterator[None]:
    """Meanwhile SIGTERM and SIGHUP raise exceptions. Afterwards they end the process at once, without a traceback."""

    def terminate(number: int, frame: FrameType | None) -> None:
        raise Terminated

    def hang_up(number: int, frame: FrameType | None) -> None:
        raise HungUp

    before = {}
    with suppress(ValueError):  # not the main thread: the caller decides
        before[signal.SIGTERM] = signal.signal(signal.SIGTERM, terminate)
        if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:  # nohup
            before[signal.SIGHUP] = signal.signal(signal.SIGHUP, hang_up)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)


if __name__ == "__main__":
    sys.exit(main())
