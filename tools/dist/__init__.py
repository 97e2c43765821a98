# SPDX-License-Identifier: MIT
"""How a distribution of the Python package is built: its native module, its programs, and the files of a release. Run
by make (packaging/packaging.mk) and by setup.py. Starts processes; writes to the folders that it is given.
"""
