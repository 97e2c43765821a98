#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""The DISPLAY of a headless LinuxCNC: switches the machine on, homes it, runs program.ngc and records samples.txt.

memory.txt gets the peak resident size of the processes that read and plan, in KiB. Started by LinuxCNC, with Debian's
own Python, which has the module `linuxcnc`; PEER_FOLDER has the files. Starts halsampler; reads the program of
PEER_FOLDER and writes both text files there.
"""

import os
import subprocess
import sys
import time
from pathlib import Path

import linuxcnc

FOLDER = Path(os.environ["PEER_FOLDER"])
LONGEST_S = 800
command, status, errors = linuxcnc.command(), linuxcnc.stat(), linuxcnc.error_channel()


def until(is_so, limit_s=LONGEST_S):
    """Waits until the status says so."""
    end = time.monotonic() + limit_s
    while True:
        status.poll()
        if is_so():
            return
        if time.monotonic() > end:
            sys.exit("LinuxCNC does not get on")
        time.sleep(0.01)


def is_done():
    """Whether the program has been read to its end and everything has come to rest."""
    return status.interp_state == linuxcnc.INTERP_IDLE and status.queue == 0 and status.inpos


def switch_on():
    """Emergency stop reset, drives on, axes at home."""
    for state in (linuxcnc.STATE_ESTOP_RESET, linuxcnc.STATE_ON):
        command.state(state)
        command.wait_complete()
    command.mode(linuxcnc.MODE_MANUAL)
    command.wait_complete()
    command.teleop_enable(0)
    command.wait_complete()
    command.home(-1)
    until(lambda: all(status.homed[:3]), 60)
    command.mode(linuxcnc.MODE_AUTO)
    command.wait_complete()


def peak_memory_kib():
    """Of milltask and rtapi_app together."""
    total = 0
    for status_file in Path("/proc").glob("[0-9]*/status"):
        lines = dict(
            line.split(":", 1) for line in status_file.read_text().splitlines() if ":" in line
        )
        if lines["Name"].strip().startswith(("milltask", "rtapi_app")):
            total += int(lines["VmHWM"].split()[0])
    return total


def main():
    """Runs the program; what LinuxCNC complained about goes to stdout."""
    switch_on()
    command.program_open(str(FOLDER / "program.ngc"))
    with (FOLDER / "samples.txt").open("w") as out:
        sampler = subprocess.Popen(["halsampler", "-t"], stdout=out)
        time.sleep(0.5)
        command.auto(linuxcnc.AUTO_RUN, 0)
        until(lambda: status.interp_state != linuxcnc.INTERP_IDLE, 60)
        until(is_done)
        time.sleep(0.5)
        sampler.terminate()
        sampler.wait()
    (FOLDER / "memory.txt").write_text(str(peak_memory_kib()))
    while message := errors.poll():
        print(message)


main()
