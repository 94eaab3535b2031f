"""The monitor: evaluates the site's rules at every control tick, with histories for past-time rules."""
