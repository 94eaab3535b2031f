"""Declared files → the resolved model: names, types and units settle here and nowhere else."""
