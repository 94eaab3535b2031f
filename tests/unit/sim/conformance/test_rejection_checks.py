"""Each of these checks accepts a whole twin of a plant and refuses one that breaks its promise."""

from __future__ import annotations

from dataclasses import replace
from math import inf, nan
from typing import Any

import pytest

from aeros.runtime.ports import MotionCompletion, NoMotion, RobotBody, Trajectory
from aeros.sim.conformance import rejection_checks
from aeros.sim.conformance.suite import Check, ConformanceError, PlantUnderTest
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


# Plans, by hand.

BODY = RobotBody(((0.0, 0.0, 0.0),), (0.0, 0.0, 0.0), ())
PIECE = ((0.5,), (0.5,), (0.75,), (1.0,))
PLAN = Trajectory(BODY, ((PIECE, ((1.0,), (1.0,), (1.0,), (1.5,))),), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0)


def scripted(plan: Any) -> PlantUnderTest:
    """A plant that plans this, whose joint is measured at 0.5 rad."""

    def make() -> FakePlant:
        plant = FakePlant({"joint_position": (0.5,)})
        plant.planned = plan
        return plant

    return PlantUnderTest(make, act("move"), act("wait"), tracking_tolerance=0.01)


@pytest.mark.parametrize(
    ("plan", "why"),
    [
        (PLAN, None),
        (NoMotion("it only grips"), None),
        (NoMotion(""), "it reports that an action moves nothing, but gives no reason"),
        (MotionCompletion(False, "unreachable"), "it cannot plan `move`"),
        (replace(PLAN, duration=0.0), "a motion takes 0.0 s"),
        (replace(PLAN, duration=nan), "a motion takes nan s"),
        (replace(PLAN, duration=inf), "a motion takes inf s"),
        (replace(PLAN, joint_paths=()), "a motion has a path without pieces"),
        (replace(PLAN, joint_paths=(*PLAN.joint_paths, ())), "a motion has a path without pieces"),
        (replace(PLAN, joint_paths=((PIECE, PIECE),)), "the pieces of a path do not join"),
        (replace(PLAN, joint_paths=(*PLAN.joint_paths, (PIECE, PIECE))), "the pieces of a path do not join"),
        (replace(PLAN, joint_paths=((((0.509,),) * 4,),)), None),
        (replace(PLAN, joint_paths=((((0.511,),) * 4,),)), "rad or m from where the joints are"),
        (replace(PLAN, joint_paths=((((0.489,),) * 4,),)), "rad or m from where the joints are"),
    ],
)
def test_a_plan_takes_time_joins_its_pieces_and_starts_where_the_robot_is(plan: Any, why: str | None) -> None:
    check = rejection_checks.a_planned_motion_begins_where_the_robot_is
    if why is None:
        check(scripted(plan))
        return
    with pytest.raises(ConformanceError, match=why):
        check(scripted(plan))


@pytest.mark.parametrize(
    ("answer", "why"),
    [
        (NoMotion("still"), "is not refused"),
        (1, "is not refused"),
        (MotionCompletion(True), "is refused without a reason"),
        (MotionCompletion(False, None), "is refused without a reason"),
        (MotionCompletion(False, " "), "is refused without a reason"),
        (MotionCompletion(True, "done"), "is refused without a reason"),
        (MotionCompletion(False, "monitor:rule"), "is refused as if by the monitor"),
        (MotionCompletion(False, "unknown kind"), None),
    ],
)
def test_a_refusal_has_a_reason_of_the_plants_own(answer: Any, why: str | None) -> None:
    if why is None:
        rejection_checks._require_reason(answer, "it")
        return
    with pytest.raises(ConformanceError, match=f"it .*{why}"):
        rejection_checks._require_reason(answer, "it")
