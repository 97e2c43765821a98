# SPDX-License-Identifier: MIT
"""How a distribution of the Python package is built: its native module, its programs, and the files of a release."""
