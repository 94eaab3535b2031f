"""Each of these checks accepts a whole twin of a plant and refuses one that breaks its promise."""

from __future__ import annotations

import pytest

from aeros.sim.conformance import rejection_checks
from aeros.sim.conformance.suite import Check, PlantUnderTest
from aeros.sim.fake import FakePlant
from aeros.skill import act
from tests.unit.sim.conformance.broken import Twin
from tests.unit.sim.conformance.twins import accept, broken_twins, refuse, whole_twins


@pytest.mark.parametrize(("check", "twin"), whole_twins(rejection_checks))
def test_the_twin_that_is_not_broken_passes(check: Check, twin: type[Twin]) -> None:
    accept(check, twin)


@pytest.mark.parametrize(("check", "twin", "why"), broken_twins(rejection_checks))
def test_a_broken_twin_is_refused(check: Check, twin: type[Twin], why: str) -> None:
    refuse(check, twin, why)


def test_invalid_actions_are_mutants_of_each_parameter() -> None:
    subject = PlantUnderTest(
        make_plant=FakePlant,
        motion_action=act("move", target=(1.0, 2.0), speed=0.5),
        parallel_action=act("say", word="hello"),
    )
    found = dict(rejection_checks.invalid_actions(subject))
    assert found["an unknown kind"] == act("no such kind")
    assert found["`move` without `speed`"] == act("move", target=(1.0, 2.0))
    assert found["`say` without `word`"] == act("say")
    assert found["`move` with `speed` = True"] == act("move", target=(1.0, 2.0), speed=True)
    assert found["`say` with `word` = 1.0"] == act("say", word=1.0)
    targets = [one.parameters["target"] for what, one in found.items() if "with `target` =" in what]
    for bad in ((1.0,), (1.0, 2.0, 0.0), (None, 2.0), (1.0, None), (True, 2.0), None, ()):
        assert bad in targets
    valid = {repr(subject.motion_action), repr(subject.parallel_action)}
    assert not valid & {repr(one) for one in found.values()}
