# SPDX-License-Identifier: MIT
"""Jobs of any length: sections of toolpaths as chains of chunks, planned, sent and recorded in bounded memory."""
