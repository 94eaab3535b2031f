"""The watch for obstacles: when it looks, and with which body."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.perception.obstacle_watch import ObstacleWatch
from aeros.runtime.ports import NoMotion, Reading, Trajectory
from aeros.skill import Action
from tests.unit.perception.test_obstacles import CUBE, seen
from tests.unit.runtime.perception.kettle import CameraPlant
from tests.unit.runtime.perception.test_obstacle_map import (
    BODY,
    FAR,
    JOINTS,
    NO_BODY,
    configured,
    motion,
    taken,
)

PLAN = Trajectory(NO_BODY, (), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0)
REST = {"joint_position": Reading(JOINTS, 1.0), "base_position": Reading((0.0, 0.0, 0.0), 1.0)}


class Setting:
    """A watch over a plant whose camera has just seen an unknown cube."""

    def __init__(self, configuration: Configuration | None = None) -> None:
        self.plant = CameraPlant()
        self.plant.taken = {"overhead": taken(seen(CUBE), 1.0)}
        self.plant.planned = PLAN
        self.watch = ObstacleWatch(self.plant, lambda *_: None)
        if configuration is not None:
            self.watch.set_configuration(configuration)

    def names(self) -> list[str]:
        self.watch.note_posture(REST)
        self.watch.look(REST, FAR)
        return [one.name for one in self.watch.obstacles()]


def without_obstacles() -> Configuration:
    found = configured()
    return replace(found, site=replace(found.site, motion=replace(motion(), obstacles=None)))


def test_it_looks_only_where_the_site_in_force_asks_for_it() -> None:
    assert Setting().names() == []
    setting = Setting(without_obstacles())
    assert setting.names() == []
    assert setting.plant.calls == []
    setting.watch.set_configuration(configured())
    assert setting.names() == ["unknown-object-1"]


def test_it_asks_for_the_body_once_by_a_motion_that_stays() -> None:
    setting = Setting(configured())
    assert setting.names() == setting.names() == ["unknown-object-1"]
    ((method, asked),) = setting.plant.calls
    assert method == "plan"
    assert isinstance(asked, Action)
    target = motion().kinds[asked.kind].joint_target
    assert target is not None
    assert [asked.parameters[one] for one in target] == list(JOINTS)


def test_a_body_that_a_plan_states_is_not_asked_for() -> None:
    setting = Setting(configured())
    setting.watch.note_plan(replace(PLAN, body=BODY))
    assert setting.names() == [], "the arm is at the place of the cube"
    assert setting.plant.calls == []


def test_without_a_body_nothing_is_looked_at() -> None:
    setting = Setting(configured())
    setting.plant.planned = NoMotion("this plant has no body")
    assert setting.names() == []
    setting.watch.note_plan(PLAN)
    assert setting.names() == ["unknown-object-1"], "the picture is still new"


def answering(now: float, measured: Mapping[str, Any]) -> str:
    return "rule"


def test_a_monitor_notes_postures_only_where_it_is_of_use() -> None:
    assert Setting(without_obstacles()).watch.noting_postures(answering) is answering
    setting = Setting(configured())
    setting.watch.note_plan(replace(PLAN, body=BODY))
    monitor = setting.watch.noting_postures(answering)
    # When the picture was taken, the robot was elsewhere, so the cube is not its arm.
    assert monitor(1.0, {"joint_position": JOINTS, "base_position": (5.0, 0.0, 0.0)}) == "rule"
    assert setting.names() == ["unknown-object-1"]
