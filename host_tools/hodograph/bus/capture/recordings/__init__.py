# SPDX-License-Identifier: MIT
"""Recordings of a bus as files: candump (.log), Vector ASC (.asc) and BLF (.blf). Used by bus/, cli/ and
monitor/source. Reads and writes the files that it is given.

The arrays are those of `Recorder.frames()` (`RECORD_DTYPE`): identifier with the flags of linux/can.h, length, data,
time in microseconds since 1970. What is written comes back exactly and in order, with these exceptions: an ASC file
keeps of an error frame only that it came; in ASC and BLF no frame is earlier than the first. candump is read and
written here, a million frames in about a second; the others by python-can, which takes ten times as long.
"""

from .files import FORMATS, RecordingWriter, check_suffix, read_recording, write_recording

__all__ = ["FORMATS", "RecordingWriter", "check_suffix", "read_recording", "write_recording"]
