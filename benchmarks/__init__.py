"""Measurements of how long AEROS takes: run a module here; `docs/benchmarks.md` has the results."""
