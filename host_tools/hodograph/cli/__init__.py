# SPDX-License-Identifier: MIT
"""The `hodograph` command: docs/reference/cli.md."""
