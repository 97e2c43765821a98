# SPDX-License-Identifier: MIT
"""Jobs of any length: read, fitted, planned, sent and recorded in chunks (parts of a job), in bounded memory;
docs/theory/feed.md 5.6 and docs/reference/protocol.md 1.7. Used by cli/stream_command and monitor/. Reads the files of
a job, keeps its plan on disk, and writes its journal; only `sender` uses the bus.
"""
