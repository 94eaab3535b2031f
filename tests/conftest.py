"""Hypothesis profiles: small and the same every time by default, deeper and random at night."""

from __future__ import annotations

import os

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
settings.load_profile(os.environ.get("AEROS_HYPOTHESIS", "ci"))
