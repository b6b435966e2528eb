"""Files that survive: atomic writes, locks, checksums, and checkpoints of finished jobs."""
