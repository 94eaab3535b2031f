"""Hypothesis profiles: small and the same each time, or deeper at night; and Ctrl-C as at a terminal."""

from __future__ import annotations

import os
import signal

from hypothesis import HealthCheck, settings

# Two shared cores make single examples slow now and then; what is measured is correctness.
settings.register_profile(
    "ci",
    max_examples=60,
    derandomize=True,
    database=None,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.register_profile(
    "nightly",
    max_examples=5_000,
    deadline=None,
    print_blob=True,
    suppress_health_check=[HealthCheck.too_slow],
)
os.environ["AEROS_CACHE"] = "off"  # what a test proves, it proves itself
# A job of a shell that is not interactive ignores Ctrl-C, and so does everything that it starts.
signal.signal(signal.SIGINT, signal.default_int_handler)
settings.load_profile(os.environ.get("AEROS_HYPOTHESIS", "ci"))
