"""How long a solver may work, in units that do not depend on the machine."""

DEFAULT_RLIMIT = 1_000_000
"""z3 resource units for one question: about a second of work; the reference modules need a fiftieth."""
