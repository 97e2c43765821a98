# SPDX-License-Identifier: MIT
"""Jobs without end: sections of toolpaths as chains of chunks, planned, sent and recorded in bounded memory."""
