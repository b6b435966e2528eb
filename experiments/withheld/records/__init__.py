"""The real part of the benchmark: recorded runs of ships, sealed wind, sensor errors put into records."""
