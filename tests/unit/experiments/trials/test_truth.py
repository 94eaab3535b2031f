"""A referee looks at what is true, with the parameters that were decided, of what moves and nothing else."""

from __future__ import annotations

from typing import Any, cast

from aeros.experiments.trials.truth import InvariantReferee, RefereedPlant
from aeros.runtime.ports import MotionCompletion, MotionHandle, Plant
from aeros.sim.sensors import GroundTruth
from aeros.sim.symbolic.plant import SymbolicPlant
from aeros.skill import act
from tests.unit.experiments.support.common import premises

SITE = premises().configuration.site
GRIP = act("grip", width=0.05, force=5.0)


def truth(**changed: Any) -> GroundTruth:
    plant = SymbolicPlant(SITE, {}, 0)
    return GroundTruth(0, {**{name: one.value for name, one in plant.observe().items()}, **changed})


def broken(person: float, **parameters: float) -> tuple[str, ...]:
    referee = InvariantReferee(SITE, "human_distance", lambda _: None)
    referee.moving[MotionHandle(1)] = act("move_base", x=1.0, y=0.0, **parameters)
    referee(truth(human_distance=person))
    return referee.broken


def test_a_rule_is_broken_by_what_is_true_for_a_motion_as_it_was_decided() -> None:
    assert broken(5.0, speed=0.4) == ()
    assert broken(1.1, speed=0.05) == ()
    assert "reduced-driving-near-person" in broken(1.1, speed=0.4)
    assert "separation" in broken(0.1, speed=0.1)


def test_a_robot_at_rest_breaks_no_rule() -> None:
    truths: list[GroundTruth] = []
    referee = InvariantReferee(SITE, "human_distance", truths.append)
    referee(truth(human_distance=0.0))
    assert (referee.broken, len(truths)) == ((), 1)


def test_a_plant_reports_motions_until_they_have_ended() -> None:
    referee = InvariantReferee(SITE, "human_distance", lambda _: None)
    named: list[str] = []
    plant = RefereedPlant(cast(Plant, SymbolicPlant(SITE, {}, 0)), referee, named.append)
    motion = plant.begin(GRIP)
    assert not isinstance(motion, MotionCompletion)
    assert referee.moving == {motion: GRIP}
    assert plant.advance(lambda *_: None, 100.0) == {motion: MotionCompletion(True)}
    assert (referee.moving, named) == ({}, [])
    plant.begin(GRIP)
    assert plant.advance(lambda *_: "a-rule", 100.0)
    assert (referee.moving, named) == ({}, ["a-rule"])
    plant.begin(GRIP)
    plant.stop()
    assert referee.moving == {}
