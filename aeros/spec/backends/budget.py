"""How long a solver may work, in units that do not depend on the machine."""

DEFAULT_RLIMIT = 5_000_000
"""z3 resource units for one question: some seconds of work; install questions need some thousands."""
