# SPDX-License-Identifier: MIT
"""`python -m hodograph` is the `hodograph` command. Started by the user; does what cli/main does, and ends the process
with its exit status.
"""

import sys

from hodograph.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
