"""How long AEROS takes, measured: run a module here, and `docs/benchmarks.md` has what it said."""
