"""Every check refuses a plant that breaks its promise, and takes the same plant that does not."""

from __future__ import annotations

from dataclasses import replace

import pytest

from aeros.sim.conformance.suite import CHECKS, Check, ConformanceError, PlantUnderTest
from tests.unit.sim.conformance.broken import BROKEN, OnItsCarriage, Twin
from tests.unit.sim.conformance.subjects import KINEMATIC, SUBJECTS

BY_NAME = {check.__name__: check for check in CHECKS}


def test_each_check_has_a_broken_twin() -> None:
    assert set(BROKEN) == set(BY_NAME)


def subject_of(twin: type[Twin]) -> PlantUnderTest:
    return SUBJECTS["kinematic on its carriage"] if issubclass(twin, OnItsCarriage) else KINEMATIC


@pytest.mark.parametrize("twin", [Twin, OnItsCarriage])
@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_the_twin_that_is_not_broken_passes(check: Check, twin: type[Twin]) -> None:
    check(replace(subject_of(twin), make_plant=twin))


@pytest.mark.parametrize(
    ("name", "twin", "why"),
    [
        pytest.param(name, twin, why, id=f"{name}-{twin.__name__}")
        for name, twins in BROKEN.items()
        for twin, why in twins.items()
    ],
)
def test_a_broken_twin_is_refused(name: str, twin: type[Twin], why: str) -> None:
    with pytest.raises(ConformanceError, match=why):
        BY_NAME[name](replace(subject_of(twin), make_plant=twin))
