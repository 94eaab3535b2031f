"""Every check refuses a plant that breaks its promise, and takes the same plant that does not."""

from __future__ import annotations

from dataclasses import replace

import pytest

from aeros.sim.conformance.suite import CHECKS, Check, ConformanceError
from tests.unit.sim.conformance.broken import BROKEN, Twin
from tests.unit.sim.conformance.subjects import KINEMATIC

BY_NAME = {check.__name__: check for check in CHECKS}


def test_each_check_has_a_broken_twin() -> None:
    assert set(BROKEN) == set(BY_NAME)


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_the_twin_that_is_not_broken_passes(check: Check) -> None:
    check(replace(KINEMATIC, make=Twin))


@pytest.mark.parametrize(
    ("name", "twin"),
    [(name, twin) for name, twins in BROKEN.items() for twin in twins],
    ids=lambda one: one if isinstance(one, str) else one.__name__,
)
def test_a_broken_twin_is_refused(name: str, twin: type[Twin]) -> None:
    with pytest.raises(ConformanceError):
        BY_NAME[name](replace(KINEMATIC, make=twin))
