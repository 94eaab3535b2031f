"""The syntax that skill code may use, and what its names and values are bound to."""
