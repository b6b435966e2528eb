"""The commands of the command line, one file each. Each returns what it found, for `--json` and for the exit code."""
