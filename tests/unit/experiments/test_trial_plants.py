"""Plants of trials: one for each seed, whose draws and counts are known."""

from __future__ import annotations

from typing import Any, cast

import pytest

from aeros.distribution import install_command
from aeros.experiments.failure_models import independent_process
from aeros.experiments.trial_plants import (
    _CountingPlant,
    missing_physics_error,
    physics_plants,
    symbolic_plants,
)
from aeros.runtime.ports import MotionCompletion, NoMotion, PlannedMotion, Plant, RobotBody, Trajectory
from aeros.sim.symbolic.plant import SymbolicPlant
from aeros.skill import Action, act
from aeros.spec.expr.doubles import to_doubles
from tests.shipped_scenes import shipped_scene
from tests.unit.experiments.support.common import model, premises

MODEL = model()
MODULE = MODEL.ecm.id


def opened(seed: int) -> Any:
    return symbolic_plants(MODEL.site, {MODULE: MODEL.ecm}, MODEL.task)(seed)


def drawn(plant: SymbolicPlant, times: int) -> None:
    for _ in range(times):
        plant.skill_began(f"{MODULE}.wrap")
        plant.skill_ended(f"{MODULE}.wrap", finished=True)


def test_each_seed_has_a_plant_that_begins_where_the_task_does() -> None:
    ready = symbolic_plants(MODEL.site, {MODULE: MODEL.ecm}, MODEL.task)
    with ready(0) as first, ready(1) as second:
        assert first.plant is not second.plant
        assert first.plant.observe() == second.plant.observe()
        assert (first.counts, first.plant.now()) == ({}, 0.0)
        for name, value in to_doubles(MODEL.task.initial).items():
            assert first.plant.observe()[name].value == value


def test_a_seed_draws_the_same_again_and_says_what_it_drew() -> None:
    found = []
    for seed in (3, 3, 4):
        with opened(seed) as one:
            assert one.equivalent_interval is not None
            assert one.equivalent_interval() == ()
            drawn(cast(SymbolicPlant, one.plant), 12)
            found.append(one.equivalent_interval())
            assert len(found[-1]) == 12
    assert found[0] == found[1] != found[2]


def test_a_missing_dependency_of_physics_is_reported() -> None:
    error = missing_physics_error(ImportError("no", name="pybullet"))
    (problem,) = error.diagnostics
    assert (problem.code, problem.help) == ("AE002", ("or use `--plant symbolic`",))
    assert problem.headline == f"the physics plant needs {install_command('sim')} (pybullet is missing)"


@pytest.mark.physics
def test_on_physics_declared_faults_happen_at_their_rate_and_are_counted() -> None:
    configuration = premises().configuration
    text = (
        "schema: aeros/faults/1\nfaults:\n"
        "  taken: {at: {skill: fetch_object.detect}, rate: 0, at_most: 1,"
        " misread: {of: fetch_object.station_survey, dropout: 1, lasts: 500 ms}}\n"
    )
    ready = physics_plants(configuration, shipped_scene("fetch"), text, {"taken": independent_process(1.0)})
    with ready(0) as one:
        assert one.counts == {"faults": 0, "ik_solutions": 0}
        assert one.equivalent_interval is not None
        assert one.equivalent_interval() == (0.0, 1.0)  # nothing was drawn yet
        for times in (1, 2):  # what the file limits to one is not limited here
            one.plant.skill_began("fetch_object.detect")
            one.plant.advance(lambda *_: None, one.plant.now() + 0.05)
            one.plant.skill_ended("fetch_object.detect", finished=True)
            assert one.counts["faults"] == times
        low, high = one.equivalent_interval()
        assert 0.0 < low < high == 1.0


class Planning:
    """A plant that returns a given plan."""

    def __init__(self, *plans: PlannedMotion) -> None:
        self._plans = iter(plans)

    def plan(self, action: Action) -> PlannedMotion:
        return next(self._plans)


def test_each_corner_of_a_planned_path_is_a_solution_and_nothing_else_is() -> None:
    still = ((0.0,) * 7,) * 4
    moved = ((0.0,) * 7, (0.1,) * 7, (0.2,) * 7, (0.3,) * 7)
    body, nowhere = RobotBody((), (0.0, 0.0, 0.0), ()), (0.0, 0.0, 0.0)

    def along(*paths: Any) -> Trajectory:
        return Trajectory(body, paths, nowhere, nowhere, 1.0)

    plans = (
        along((moved, moved, moved)),
        along((moved, moved), (moved,)),
        along((still,)),
        NoMotion("it waits"),
        MotionCompletion(False, "unreachable"),
    )
    counts = {"ik_solutions": 0}
    plant = _CountingPlant(cast(Plant, Planning(*plans)), counts)
    seen = []
    for _ in plans:
        plant.plan(act("move_tool"))
        seen.append(counts["ik_solutions"])
    assert seen == [4, 4 + 3 + 2, 9, 9, 9]
