"""Budget of a solver, in units of work that do not depend on the machine."""

DEFAULT_RLIMIT = 1_000_000
"""Z3's resource units for one question: about a second of work; the reference modules need a fiftieth."""
