"""Hypothesis profiles: few examples in `make test`, the same ones each time; many new ones in `make deep`.

`AEROS_HYPOTHESIS` names the profile. A test that needs another number of examples than the profile's asks
for it with `examples`, so that the profile still decides how deep it goes.
"""

from __future__ import annotations

import os
from typing import Any, Final

from hypothesis import HealthCheck, settings

PROFILES: Final = {"ci": 0.75, "nightly": 25}
"""Factor by which each profile multiplies the number of examples, dimensionless."""

PROFILE: Final = os.environ.get("AEROS_HYPOTHESIS", "ci")
"""Name of the profile of this run."""

_DEFAULT_EXAMPLES: Final = 27


def _register_profiles() -> None:
    """Register all profiles and load the one of this run."""
    for name, factor in PROFILES.items():
        settings.register_profile(
            name,
            max_examples=round(factor * _DEFAULT_EXAMPLES),
            derandomize=name == "ci",
            database=None,
            # Two shared cores make single examples slow now and then; correctness is checked, not time.
            deadline=None,
            print_blob=True,
            suppress_health_check=[HealthCheck.too_slow],
        )
    settings.load_profile(PROFILE)


def examples(count: int, **more: Any) -> settings:
    """Make settings for a test that needs more or fewer examples than the profile gives.

    Args:
        count: examples, which each profile multiplies by its factor in `PROFILES`.
        more: further settings of Hypothesis. Whether examples are drawn anew is the profile's to say.

    Returns:
        The profile's settings with that number of examples and without health checks.
    """
    return settings(
        max_examples=max(1, round(PROFILES[PROFILE] * count)), suppress_health_check=list(HealthCheck), **more
    )


_register_profiles()
