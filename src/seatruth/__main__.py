"""`python -m seatruth` is the command `seatruth`."""

from seatruth.cli import main

if __name__ == "__main__":
    main()
