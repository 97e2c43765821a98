# SPDX-License-Identifier: MIT
"""The `hodograph` command: docs/reference/cli.md. Started by the user. Its modules read and write files, use the bus,
start processes, and print to stdout and stderr.
"""
