"""The engines that engine_speed.py compares, each on the same two workloads."""
