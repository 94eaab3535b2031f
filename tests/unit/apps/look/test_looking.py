"""One look of a module's perceivers: pictures are taken, values kept beside the truth, failures named."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest

from aeros.apps.look.looking import Look, look
from aeros.runtime.execution.governor import FixedGovernor
from aeros.runtime.perception.perceiver_run import PerceiverError
from aeros.runtime.perception.perceiving_plant import PerceivingPlant
from aeros.runtime.ports import MotionCompletion, MotionHandle, PlannedMotion
from aeros.skill import Action
from aeros.spec.model.ecm import Ecm
from tests.unit.runtime.perception.kettle import CameraPlant, Scripted, configuration, kettle

HOT = {"water_hot": True}


class LookingPlant(CameraPlant):
    """A plant whose camera `overhead` takes a picture at each `look`, or loses it."""

    def __init__(self, lost: int = 0, **truth: int) -> None:
        super().__init__()
        self.lost, self.known = lost, truth
        self.looks: list[str] = []

    def begin(self, action: Action, decided: PlannedMotion | None = None) -> MotionHandle:
        self.looks.append(action.parameters["camera"])
        if self.lost:
            self.lost -= 1
        elif self.looks[-1] == "overhead":
            self.take()
        return super().begin(action, decided)

    def truth(self) -> Mapping[str, int]:
        return self.known


class RefusingPlant(PerceivingPlant):
    """A plant without cameras."""

    def begin(self, action: Action, decided: PlannedMotion | None = None) -> MotionCompletion:
        return MotionCompletion(False, f"unknown camera: `{action.parameters['camera']}`")


def looked(plant: LookingPlant, *answers: Mapping[str, Any] | Exception, ecm: Ecm | None = None) -> Look:
    runs = Scripted(*answers or (HOT,))
    found = look(configuration(ecm or kettle()), "kettle", plant, runs, stated={})
    assert runs.opened == runs.closed  # every worker has ended
    return found


def values(found: Look) -> dict[str, Any]:
    return {one.declared.name: one for look in found.perceivers for one in look.values}


def test_each_value_stands_beside_the_truth_of_the_scene() -> None:
    plant = LookingPlant(water_hot=True)
    found = looked(plant, {"water_hot": (True, None), "water_level": (0.2, 0.001)})
    hot, level = values(found)["kettle.water_hot"], values(found)["kettle.water_level"]
    assert plant.looks == ["overhead"]
    assert (hot.value, hot.truth, hot.is_false) == (True, True, False)
    assert (level.value, level.uncertainty, level.truth) == (0.2, 0.001, None)
    assert found.is_right
    assert list(found.pictures) == ["overhead"]


def test_a_value_that_the_truth_contradicts_is_found() -> None:
    found = looked(LookingPlant(water_hot=False))
    assert values(found)["kettle.water_hot"].is_false
    assert not found.is_right


def test_a_value_that_is_too_uncertain_or_missing_is_unknown_with_the_reason() -> None:
    found = looked(LookingPlant(), {"water_level": (0.2, 5.0)})
    level, hot = values(found)["kettle.water_level"], values(found)["kettle.water_hot"]
    assert (level.value, level.uncertainty, level.reason) == (None, 5.0, "less certain than declared")
    assert (hot.value, hot.reason) == (None, "not given")
    assert found.is_right


@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        (PerceiverError("perceivers.py:9: KeyError 'x'"), "perceivers.py:9: KeyError 'x'"),
        ({"water_hot": 3}, "it measured 3 in SI units"),
    ],
)
def test_a_failure_is_named_and_the_look_is_not_right(
    answer: Mapping[str, Any] | Exception, reason: str
) -> None:
    found = looked(LookingPlant(), answer)
    assert reason in found.perceivers[0].fault
    assert not found.is_right


def test_a_lost_picture_is_taken_again_and_a_camera_that_loses_all_is_named() -> None:
    plant = LookingPlant(lost=2)
    assert looked(plant).is_right
    assert len(plant.looks) == 3
    found = looked(LookingPlant(lost=9))
    assert found.perceivers[0].fault == "not called: no picture of `overhead` (the camera lost 5 pictures)"


def test_a_camera_that_the_scene_does_not_have_is_named() -> None:
    governor = FixedGovernor(configuration(kettle()))
    plant = RefusingPlant(LookingPlant(), governor, Scripted(HOT), lambda event, details: None)
    found = look(configuration(kettle()), "kettle", plant, Scripted(HOT), stated={})
    assert "no picture of `overhead` (unknown camera: `overhead`)" in found.perceivers[0].fault
    assert not found.is_right


def test_a_picture_that_the_plant_breaks_off_has_its_reason() -> None:
    plant = LookingPlant(lost=1)
    plant.script([MotionCompletion(False, "halted")])
    assert looked(plant).perceivers[0].fault == "not called: no picture of `overhead` (halted)"


def test_no_picture_is_taken_with_a_camera_that_is_not_chosen() -> None:
    plant = LookingPlant()
    found = look(configuration(kettle()), "kettle", plant, Scripted(HOT), cameras=["side"], stated={})
    assert set(plant.looks) == {"side"}
    assert found.perceivers[0].fault.startswith("not called: no picture of `overhead`")
    assert found.is_right  # nobody asked for more


def test_the_readings_of_a_perceiver_with_a_rate_are_sampled_while_the_picture_is_taken() -> None:
    one = kettle().perceivers["kettle_view"]
    sampling = replace(kettle(), perceivers={one.id: replace(one, rate=Fraction(100))})
    runs = Scripted(HOT)
    found = look(configuration(sampling), "kettle", LookingPlant(), runs, stated={})
    assert found.is_right
    assert runs.views[-1].samples["tool_position"]
