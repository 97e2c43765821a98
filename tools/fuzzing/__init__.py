# SPDX-License-Identifier: MIT
"""Parts of tools/fuzz.py: mutated input for the Python side, and libFuzzer for the C side (docs/validation/testing.md).
Used by tools/fuzz. Starts processes; writes to build/fuzz.
"""
