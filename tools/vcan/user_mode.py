# SPDX-License-Identifier: MIT
"""Starts a Linux kernel as a process (user-mode Linux) and ends it with all its processes. Used by vcan/broker and
vcan/main, outside of that kernel. Starts and ends processes; writes to the folder of the bus.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import platform
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

from vcan.errors import BusUnavailable
from vcan.registry import Bus

_NICE = -10
_PR_SET_PDEATHSIG = 1
_PR_SET_CHILD_SUBREAPER = 36
_LIBC = ctypes.CDLL(None)
_MODULES = Path("/usr/lib/uml/modules")
_HERE = Path(__file__).resolve().parent
_COMPILER = ("gcc", "-O2", "-shared", "-fPIC")


def boot(bus: Bus, line: socket.socket, memory: str) -> subprocess.Popen[bytes]:
    """Starts the kernel. Descriptors: its serial line is `line`, its console goes to the log."""
    (bus.folder / "init").symlink_to(_HERE / "init.sh")
    modules = next(iter(sorted(_MODULES.iterdir())), None) if _MODULES.is_dir() else None
    if modules is None:
        raise BusUnavailable(
            f"no modules of user-mode Linux under {_MODULES}; apt-get install user-mode-linux"
        )
    _boot_file(
        bus.folder / "boot",
        PYTHON=sys.executable,
        AGENT=str(_HERE / "agent.py"),
        MODULES=str(modules),
        HOST=platform.node(),
    )
    library = large_registers(bus.folder)
    fd = line.fileno()
    with (bus.folder / "log").open("wb") as log:
        return subprocess.Popen(
            [
                shutil.which("linux.uml") or "/usr/bin/linux.uml",
                f"mem={memory}",
                "rootfstype=hostfs",
                "rw",
                "quiet",
                f"init={bus.folder}/init",
                "con=null",
                f"con0=null,fd:{log.fileno()}",
                "ssl=null",
                f"ssl0=fd:{fd},fd:{fd}",
                f"uml_dir={bus.folder}/",
            ],
            pass_fds=(fd, log.fileno()),
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=log,
            cwd="/",
            env={
                "PATH": os.environ.get("PATH", "/usr/bin:/bin"),
                "TMPDIR": _memory_folder(memory),
                "HOME": str(bus.folder),
                "LD_PRELOAD": str(library),
            },
            start_new_session=True,
            preexec_fn=lambda: _prepare_kernel(bus.cpu),
        )


def large_registers(folder: Path) -> Path:
    """Compiles large_registers.c, which user-mode Linux needs on some processors."""
    library = folder / "large_registers.so"
    source = _HERE / "large_registers.c"
    try:
        subprocess.run(
            [*_COMPILER, "-o", str(library), str(source)],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=True,
        )
    except FileNotFoundError as error:
        raise BusUnavailable(f"{_COMPILER[0]} is missing; apt-get install gcc libc6-dev") from error
    except subprocess.CalledProcessError as error:
        raise BusUnavailable(f"{source} does not compile: {error.stderr.strip()}") from error
    return library


def _prepare_kernel(cpu: int | None) -> None:
    """One core, since waking a process on another one takes long; before ordinary work, where permitted.

    And it is to end with the broker: at SIGTERM user-mode Linux ends its stub processes too.
    """
    _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
    if cpu is not None:
        os.sched_setaffinity(0, {cpu})
    with contextlib.suppress(PermissionError):
        os.setpriority(os.PRIO_PROCESS, 0, _NICE)


def _boot_file(path: Path, **values: str) -> None:
    quoted = {name: value.replace("'", "'\\''") for name, value in values.items()}
    path.write_text("".join(f"{name}='{value}'\n" for name, value in quoted.items()))


def _memory_folder(memory: str) -> str:
    """Where the kernel's memory file can lie: writable, room for all of it, mapping as code not forbidden."""
    need = int(memory.rstrip("MG")) << (30 if memory.endswith("G") else 20)
    for folder in ("/dev/shm", "/tmp", "/var/tmp"):
        with contextlib.suppress(OSError):
            facts = os.statvfs(folder)
            room = facts.f_bavail * facts.f_frsize >= need and not facts.f_flag & os.ST_NOEXEC
            if room and os.access(folder, os.W_OK | os.X_OK):
                return folder
    raise BusUnavailable(
        f"neither /dev/shm, /tmp nor /var/tmp is writable, allows code and has {memory} free; "
        "make room or use --memory 512M"
    )


def adopt_orphans() -> None:
    """Makes processes whose parent dies children of this process, if they descend from it."""
    _LIBC.prctl(_PR_SET_CHILD_SUBREAPER, 1)


def end_children() -> None:
    """Ends every child of this process and what it leaves behind; needs `adopt_orphans` before."""
    children = Path(f"/proc/self/task/{os.getpid()}/children")
    with contextlib.suppress(ChildProcessError):
        while True:
            for child in children.read_text().split():
                with contextlib.suppress(ProcessLookupError):
                    os.kill(int(child), signal.SIGKILL)
            os.waitpid(-1, 0)


def end(kernel: subprocess.Popen[bytes]) -> None:
    """Ends the kernel and the stub processes it runs its processes in: all are of its session."""
    with contextlib.suppress(ProcessLookupError):
        while True:
            os.killpg(kernel.pid, signal.SIGKILL)
            with contextlib.suppress(ChildProcessError):
                while os.waitpid(-1, os.WNOHANG)[0]:
                    pass
            time.sleep(0.002)
