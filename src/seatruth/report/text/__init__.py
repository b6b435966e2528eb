"""What reports say in sentences: one module for each kind of report."""
