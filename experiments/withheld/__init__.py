"""The withheld-effect benchmark: cases whose cause is sealed, the diagnosis of them, and the score."""
