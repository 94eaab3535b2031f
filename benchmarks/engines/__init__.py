"""Comparisons of the physics engines."""
