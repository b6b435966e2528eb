"""The study file: its schema, where its keys stand, what is wrong with it, and how it becomes a study."""
