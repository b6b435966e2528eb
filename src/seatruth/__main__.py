"""`python -m seatruth` is the command `seatruth`."""

from seatruth.cli import main

main()
