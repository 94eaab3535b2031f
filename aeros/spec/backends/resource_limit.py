"""Budget of a solver: units of work that do not depend on the machine, and a time limit behind them."""

DEFAULT_RLIMIT = 1_000_000
"""Z3's resource units for one question: about a second of work; the reference modules need a fiftieth."""

QUESTION_SECONDS = 10.0
"""Time limit of one question, s: ten times what `DEFAULT_RLIMIT` takes, for work that Z3 does not count."""

MAX_TIMEOUTS = 6
"""Questions of one run that may have no answer in time, so that a run waits for a minute of them at most."""
