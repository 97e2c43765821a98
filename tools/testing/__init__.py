# SPDX-License-Identifier: MIT
"""How the tests are chosen, run and counted: the parts of tools/run_tests.py. `cache` is for other tools too. Used by
tools/run_tests, tools/count, tools/lint_changed and analysis/. Starts processes; writes to the build folder and to the
cache folder.
"""
