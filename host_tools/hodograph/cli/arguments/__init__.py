# SPDX-License-Identifier: MIT
"""What the commands take, by families; `options` has what several of them take."""
