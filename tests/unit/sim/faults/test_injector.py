"""Declared faults begin and end in time, on parts that only count; test_injector_physics.py has bodies."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from aeros.runtime.ports import CameraPicture, CameraView
from aeros.sim.clock import TICK
from aeros.sim.faults.injector import FaultEvent, FaultInjector
from aeros.sim.faults.model import (
    CameraOpportunity,
    Fault,
    Opportunity,
    PhysicalFault,
    PictureFault,
    SkillOpportunity,
    TimedOpportunity,
)
from aeros.sim.gilbert_elliott import GilbertElliottProcess
from aeros.sim.physics import PlantParts
from aeros.spec.declared.faults import (
    GripForceFault,
    MisplacedPictureFault,
    MissedPictureFault,
    PadFrictionFault,
)
from aeros.spec.diagnostics.errors import MisuseError

SKILL = "test.carry"


def picture(camera: str = "mast") -> CameraPicture:
    """A grey picture of 2 x 2 pixels, 1 m deep."""
    depth = np.full(4, 1.0, np.float32).tobytes()
    return CameraPicture(camera, 0.0, 2, 2, b"\x80" * 12, depth, VIEW)


VIEW = CameraView((1.0, 2.0, 3.0), (1.0, 2.0, 0.0), (1.0, 0.0, 0.0), 50.0)


def fault(kind: PhysicalFault | PictureFault, on: Opportunity, name: str = "it", rate: float = 1.0) -> Fault:
    return Fault(name, on, GilbertElliottProcess(0.0, 0.0, 1.0, 1.0, rate), kind)


class Run:
    """Faults on a robot whose friction and grip are noted in each tick."""

    def __init__(self, *faults: Fault) -> None:
        self.events: list[FaultEvent] = []
        self.holding = False
        self.frictions: list[float] = []
        self.grips: list[float] = []
        self.world = SimpleNamespace(ticks=0, time=0.0)
        robot = SimpleNamespace(
            finger_friction=1.0,
            grip_command=(0.0, 20.0),
            is_holding=lambda: self.holding,
            set_finger_friction=self.frictions.append,
            set_finger_motors=lambda width, force: self.grips.append(force),
        )
        self.injector = FaultInjector(faults, 0, self.events.append)
        parts = SimpleNamespace(
            world=self.world, robot=robot, sensors=SimpleNamespace(models={}), scanners=None
        )
        self.injector.attach(cast("PlantParts", parts))

    def ticks(self, count: int) -> None:
        for _ in range(count):
            self.injector.before_tick()
            self.world.ticks += 1
            self.world.time = self.world.ticks * TICK

    def reported(self) -> list[tuple[int, str, str, int]]:
        return [(round(one.time / TICK), one.event, one.fault, one.opportunity) for one in self.events]


SLIP = PadFrictionFault(0.5, 4)


def on_skill(delay: int = 0, *, first_grip: bool = False) -> SkillOpportunity:
    return SkillOpportunity(SKILL, delay, from_first_grip=first_grip)


def test_a_fault_begins_with_its_skill_and_ends_after_its_ticks() -> None:
    run = Run(fault(SLIP, on_skill()))
    run.ticks(3)
    run.injector.skill_began("test.other")
    run.injector.skill_began(SKILL)
    run.ticks(6)
    assert run.reported() == [(3, "fault-started", "it", 1), (7, "fault-ended", "it", 1)]
    assert [one.text for one in run.events] == [
        "fault `it` begins (opportunity 1)",
        "fault `it` is over (opportunity 1)",
    ]
    assert run.frictions == [0.5, 1.0]


def test_a_delay_is_counted_from_the_skills_beginning() -> None:
    run = Run(fault(SLIP, on_skill(5)))
    run.ticks(2)
    run.injector.skill_began(SKILL)
    run.ticks(9)
    assert run.reported()[0] == (7, "fault-started", "it", 1)


def test_a_fault_may_wait_until_something_is_held() -> None:
    run = Run(fault(SLIP, on_skill(2, first_grip=True)))
    run.injector.skill_began(SKILL)
    run.ticks(10)
    assert run.reported() == []
    run.holding = True
    run.ticks(1)
    run.holding = False
    run.ticks(5)
    assert run.reported() == [(12, "fault-started", "it", 1)]


def test_a_fault_that_has_not_started_ends_with_its_skill() -> None:
    run = Run(fault(SLIP, on_skill(5)), fault(SLIP, SkillOpportunity("test.other", 5, False), "other"))
    run.injector.skill_began(SKILL)
    run.injector.skill_began("test.other")
    run.ticks(2)
    run.injector.skill_ended(SKILL)
    run.ticks(10)
    assert run.reported() == [
        (2, "fault-not-triggered", "it", 1),
        (5, "fault-started", "other", 1),
        (9, "fault-ended", "other", 1),
    ]
    assert run.events[0].text == "fault `it` not triggered: `test.carry` ended first (opportunity 1)"


def test_a_fault_that_has_started_continues_after_its_skill() -> None:
    run = Run(fault(SLIP, on_skill()))
    run.injector.skill_began(SKILL)
    run.ticks(1)
    run.injector.skill_ended(SKILL)
    run.ticks(9)
    assert run.reported() == [(0, "fault-started", "it", 1), (4, "fault-ended", "it", 1)]


def test_every_invocation_is_an_opportunity_with_a_number() -> None:
    run = Run(fault(SLIP, on_skill()))
    for _ in range(3):
        run.injector.skill_began(SKILL)
        run.ticks(6)
        run.injector.skill_ended(SKILL)
    assert [number for _, event, _, number in run.reported() if event == "fault-started"] == [1, 2, 3]


def test_an_opportunity_that_is_not_taken_is_counted_and_not_reported() -> None:
    run = Run(fault(SLIP, on_skill(), rate=0.0))
    run.injector.skill_began(SKILL)
    run.ticks(5)
    assert run.reported() == []
    run = Run(replace(fault(SLIP, on_skill()), max_count=1))
    for _ in range(2):
        run.injector.skill_began(SKILL)
        run.ticks(6)
    assert [event for _, event, _, _ in run.reported()] == ["fault-started", "fault-ended"]


def test_a_timed_fault_begins_after_each_period_and_not_at_the_start() -> None:
    run = Run(fault(PadFrictionFault(0.5, 1), TimedOpportunity(4)))
    run.ticks(13)
    assert [(time, number) for time, event, _, number in run.reported() if event == "fault-started"] == [
        (4, 1),
        (8, 2),
        (12, 3),
    ]


def test_faults_act_together_and_the_worst_counts() -> None:
    first = fault(PadFrictionFault(0.5, 6), TimedOpportunity(4), "first")
    second = fault(PadFrictionFault(0.25, 2), TimedOpportunity(5), "second")
    grip = fault(GripForceFault(7.0, 1), TimedOpportunity(6), "grip")
    run = Run(*(replace(one, max_count=1) for one in (first, second, grip)))
    run.ticks(14)
    assert run.frictions == [0.5, 0.25, 0.5, 1.0]
    assert run.grips == [7.0, 20.0]


# Pictures.


def test_a_picture_of_its_camera_is_an_opportunity_of_a_picture_fault() -> None:
    run = Run(fault(MissedPictureFault(), CameraOpportunity("mast")))
    assert run.injector.disturb_picture(picture("hand")) == picture("hand")
    assert run.reported() == []
    run.ticks(5)
    assert run.injector.disturb_picture(picture()).rgb == b"\xff" * 12
    assert run.reported() == [(5, "fault-started", "it", 1)]
    assert run.events[0].text == "fault `it` happens (opportunity 1)"


def test_an_opportunity_may_last_as_long_as_its_skill() -> None:
    run = Run(fault(MissedPictureFault(), CameraOpportunity("mast", SKILL)))

    def sees() -> bool:
        return run.injector.disturb_picture(picture()) == picture()

    assert sees()
    run.injector.skill_began(SKILL)
    run.injector.skill_began(SKILL)
    assert not sees()
    run.injector.skill_ended(SKILL)
    assert not sees()
    run.injector.skill_ended(SKILL)
    assert sees()


def test_displacements_add_up_and_a_dazzled_camera_stays_dazzled() -> None:
    x = fault(MisplacedPictureFault(0.5, (1.0, 0.0, 0.0)), CameraOpportunity("mast"), "x")
    z = fault(MisplacedPictureFault(0.25, (0.0, 0.0, 1.0)), CameraOpportunity("mast"), "z")
    missed = fault(MissedPictureFault(), CameraOpportunity("mast"), "missed")
    both = Run(x, z).injector.disturb_picture(picture()).view
    assert (both.eye, both.target) == ((1.5, 2.0, 3.25), (1.5, 2.0, 0.25))
    one, other = (Run(*faults).injector.disturb_picture(picture()) for faults in ((missed, x), (x, missed)))
    assert one == other
    assert one.rgb == b"\xff" * 12


def test_a_fault_of_pictures_needs_a_camera() -> None:
    run = Run(fault(MissedPictureFault(), on_skill()))
    run.injector.skill_began(SKILL)
    with pytest.raises(MisuseError, match="`it` is a fault of pictures and needs `at: look`"):
        run.ticks(1)


# Rates with which the run would be the same.


def test_the_interval_of_equivalent_rates_is_that_of_all_faults() -> None:
    def rates(*given: float) -> tuple[float, float]:
        faults = [fault(SLIP, on_skill(), f"f{n}", rate) for n, rate in enumerate(given)]
        run: Any = Run(*faults)
        for _ in range(4):
            run.injector.skill_began(SKILL)
            run.ticks(1)
        found: tuple[float, float] = run.injector.equivalent_rates
        return found

    assert rates() == (0.0, 1.0)
    low, high = rates(0.5)
    assert 0.0 <= low < 0.5 < high <= 1.0
    both = rates(0.5, 0.5)
    assert low <= both[0] < 0.5 < both[1] <= high
    assert both != (low, high)
    assert FaultInjector((), 0, lambda event: None).equivalent_rates == (0.0, 1.0)
