"""The port of physics engines, and the parts of a simulated cell that are the same on each."""
