"""Experiments: architectures in seeded trials, and what was measured beside what is exact."""
