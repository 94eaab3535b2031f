"""Theorems about AEROS itself: obligations made from the code that ships, for two solvers."""
