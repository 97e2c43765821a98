# SPDX-License-Identifier: MIT
"""The `hodograph` command: docs/cli.md."""
