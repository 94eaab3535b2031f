"""Each of these checks accepts a whole twin of a plant and refuses one that breaks its promise."""

from __future__ import annotations

import pytest

from aeros.sim.conformance import stop_checks
from aeros.sim.conformance.suite import Check
from tests.unit.sim.conformance.broken import Twin
from tests.unit.sim.conformance.twins import accept, broken_twins, refuse, whole_twins


@pytest.mark.parametrize(("check", "twin"), whole_twins(stop_checks))
def test_the_twin_that_is_not_broken_passes(check: Check, twin: type[Twin]) -> None:
    accept(check, twin)


@pytest.mark.parametrize(("check", "twin", "why"), broken_twins(stop_checks))
def test_a_broken_twin_is_refused(check: Check, twin: type[Twin], why: str) -> None:
    refuse(check, twin, why)
