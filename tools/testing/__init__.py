# SPDX-License-Identifier: MIT
"""How the tests are chosen, run and counted: the parts of tools/run_tests.py."""
