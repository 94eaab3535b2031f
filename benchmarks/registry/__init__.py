"""Benchmarks of the registry of a robot."""
