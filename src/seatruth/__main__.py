"""`python -m seatruth` is the command `seatruth`."""

import os
import sys

# Python puts the working directory in front of its search path: a file of a standard name beside a study would be run.
if not sys.flags.safe_path and sys.path and sys.path[0] in ("", os.getcwd()):
    del sys.path[0]

from seatruth.cli import main

if __name__ == "__main__":
    main()
