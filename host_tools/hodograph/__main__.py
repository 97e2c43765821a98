# SPDX-License-Identifier: MIT
"""`python -m hodograph` is the `hodograph` command."""

import sys

from hodograph.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
