# SPDX-License-Identifier: MIT
"""tools/vcan/large_registers.c: a tracer that knows a part of the registers can restore them.

This is what user-mode Linux 6.1 does on a processor with AMX. Here the part is so small that every processor has more.
Run by pytest; compiles a library into a temporary folder, and starts Python with it.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from vcan import user_mode

TRACER = """
import ctypes, os, signal
GET, SET, TRACE_ME, PEEK, NT_X86_XSTATE = 0x4204, 0x4205, 0, 1, 0x202
PART = 576  # x87, SSE and the header, without AVX
libc = ctypes.CDLL(None, use_errno=True)
libc.ptrace.restype = ctypes.c_long
class Part(ctypes.Structure):
    _fields_ = [("base", ctypes.c_void_p), ("size", ctypes.c_size_t)]
def ptrace(request, address=0, data=None):
    ctypes.set_errno(0)
    result = libc.ptrace(request, pid, ctypes.c_void_p(address), data)
    return result, ctypes.get_errno()
word = ctypes.c_long(-123456789)
pid = os.fork()
if pid == 0:
    libc.ptrace(TRACE_ME, 0, None, None)
    os.kill(os.getpid(), signal.SIGSTOP)
    os._exit(7)
os.waitpid(pid, 0)
registers = ctypes.create_string_buffer(PART)
part = Part(ctypes.addressof(registers), PART)
assert ptrace(GET, NT_X86_XSTATE, ctypes.byref(part)) == (0, 0)
assert ptrace(PEEK, ctypes.addressof(word)) == (word.value, 0)
registers[512] = 3  # the parts that are given: x87 and SSE
print(*ptrace(SET, NT_X86_XSTATE, ctypes.byref(part)))
after = ctypes.create_string_buffer(PART)
part = Part(ctypes.addressof(after), PART)
ptrace(GET, NT_X86_XSTATE, ctypes.byref(part))
print(after.raw[32:512] == registers.raw[32:512])
os.kill(pid, signal.SIGKILL)
"""


def _traced(**environment: str) -> list[str]:
    done = subprocess.run(
        [sys.executable, "-c", TRACER],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.split()


def test_a_part_of_the_registers_is_restored(tmp_path: Path) -> None:
    library = user_mode.large_registers(tmp_path)
    assert _traced(LD_PRELOAD=str(library)) == ["0", "0", "True"]


def test_without_the_library_linux_refuses_a_part() -> None:
    assert _traced()[0] == "-1"
