"""Twins of the kinematic plant, each of which breaks one promise of its port."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np

from aeros.runtime.ports import (
    Monitor,
    MotionCompletion,
    MotionHandle,
    PlannedMotion,
    Reading,
    Readings,
    Trajectory,
)
from aeros.sim.clock import TICK
from aeros.sim.kinematic.plant import KinematicPlant
from aeros.sim.kinematic.scenes.declared_scene import DeclaredScene
from aeros.skill import Action
from tests.shipped_scenes import shipped_scene


class Twin(KinematicPlant):
    """The plant as it should be."""

    def __init__(self, scene: str = "bare") -> None:
        super().__init__(DeclaredScene(shipped_scene(scene)), 0)

    def creep(self, joints: float = 1e-3) -> None:
        """Move the arm a little, though nobody asked for it."""
        self._robot.command(self._robot.q_command + joints, np.zeros(7))
        self._arm.tick()
        self._state = self._robot.read_sensors()


class ClockThatIsSetBack(Twin):
    """After a while its clock is set back, as at the end of summer."""

    def now(self) -> float:
        return super().now() - (0.1 if super().now() > 0.2 else 0.0)


class ReadingsOfTheFuture(Twin):
    def observe(self) -> Readings:
        return {name: Reading(one.value, one.time + TICK) for name, one in super().observe().items()}


class ReadingsThatAreNeverRenewed(Twin):
    def observe(self) -> Readings:
        return {name: Reading(one.value, 0.0) for name, one in super().observe().items()}


class ReadingsThatStandStillAtRest(Twin):
    """A plant that keeps showing the readings of the end of its motion."""

    shown: Readings | None = None

    def observe(self) -> Readings:
        return self.shown or super().observe()

    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        before = super().observe()
        over = super().advance(monitor, until)
        self.shown = None if over else before
        return over


class ReadingsThatAreNumPys(Twin):
    def observe(self) -> Readings:
        readings = super().observe()
        gap = readings["finger_gap"]
        return {**readings, "finger_gap": Reading(np.float64(gap.value), gap.time)}


class ObservingThatMovesWhatIsUnderWay(Twin):
    def observe(self) -> Readings:
        if self._under_way:
            self.creep(1e-5)
        return super().observe()


class ReadingsThatWaitForTheEnd(Twin):
    """Amid a motion, what was measured at its beginning goes on being shown."""

    first: Readings = {}  # noqa: RUF012  never changed

    def observe(self) -> Readings:
        self.first = (self.first or super().observe()) if self._under_way else {}
        return self.first or super().observe()


class PlanThatMoves(Twin):
    def plan(self, action: Action) -> PlannedMotion:
        self.creep()
        return super().plan(action)


class PlanThatSees(Twin):
    """A plant that shows an action's detection as soon as the action is planned."""

    planned = False

    def plan(self, action: Action) -> PlannedMotion:
        self.planned = True
        return super().plan(action)

    def observe(self) -> Readings:
        return {**super().observe(), "object_detected": Reading(self.planned, self.now())}


class PlanFromElsewhere(Twin):
    def plan(self, action: Action) -> PlannedMotion:
        plan = super().plan(action)
        if not isinstance(plan, Trajectory):
            return plan
        moved = tuple(
            tuple(tuple(q + 0.01 for q in corner) for corner in piece) for piece in plan.joint_paths[0]
        )
        return replace(plan, joint_paths=(moved,))  # type: ignore[arg-type]


class BeginThatMoves(Twin):
    def begin(self, action: Action, decided: PlannedMotion | None = None) -> MotionHandle | MotionCompletion:
        started = super().begin(action, decided)
        self.creep()
        return started


class StalePlansAreAccepted(Twin):
    def begin(self, action: Action, decided: PlannedMotion | None = None) -> MotionHandle | MotionCompletion:
        started = super().begin(action, decided)
        return (
            super().begin(action)
            if isinstance(started, MotionCompletion) and decided is not None
            else started
        )


class BadInputRaises(Twin):
    def begin(self, action: Action, decided: PlannedMotion | None = None) -> MotionHandle | MotionCompletion:
        sum(action.parameters.values(), start=0.0) if action.kind == "wait" else None
        return super().begin(action, decided)


class BadInputIsRefusedWithoutAReason(Twin):
    def plan(self, action: Action) -> PlannedMotion:
        plan = super().plan(action)
        return MotionCompletion(False) if isinstance(plan, MotionCompletion) else plan


class UnknownParametersAreIgnored(Twin):
    def plan(self, action: Action) -> PlannedMotion:
        known = {name: value for name, value in action.parameters.items() if name != "no_such_parameter"}
        return super().plan(Action(action.kind, known))


class MonitorLooksAtEverySecondTick(Twin):
    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        looks = 0

        def second(now: float, values: Mapping[str, Any]) -> str | None:
            nonlocal looks
            looks += 1
            return monitor(now, values) if looks % 2 else None

        return super().advance(second, until)


class MonitorNeverLooksBefore(Twin):
    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        start = self.now()
        return super().advance(lambda now, values: monitor(now, values) if now > start else None, until)


class AnotherWayThanDecided(Twin):
    """At its ends it is where it should be; in between it makes a detour."""

    def _fast_values(self) -> dict[str, Any]:
        values = super()._fast_values()
        speed = np.array(values["joint_velocity"])
        values["joint_position"] = tuple((np.array(values["joint_position"]) + 0.01 * speed).tolist())
        return values


class OffWithoutSayingSo(Twin):
    """It is 20 mrad beside its path, and reports that it follows."""

    def _fast_values(self) -> dict[str, Any]:
        values = super()._fast_values()
        if self._running_motions():
            q = values["joint_position"]
            values.update(joint_position=(q[0] + 0.02, *q[1:]), tracking_error=0.0)
        return values


class ChainOfIntegers(Twin):
    """A plant that writes `0` in its chain where it is 0.0: equal, and of another type."""

    def plan(self, action: Action) -> PlannedMotion:
        plan = super().plan(action)
        if not isinstance(plan, Trajectory) or self._planned is None:
            return plan
        rows = tuple((0 if row[0] == 0.0 else row[0], *row[1:]) for row in plan.body.dh_rows)
        same = replace(plan, body=replace(plan.body, dh_rows=rows))
        self._planned = (self._planned[0], self._planned[1]._replace(plan=same))
        return same


class FasterThanDecided(Twin):
    """It is where it should be at every second tick, and makes the way of two ticks in one."""

    last: tuple[float, ...] = ()

    def _fast_values(self) -> dict[str, Any]:
        values = super()._fast_values()
        if self._ticks % 2 and self._running_motions():
            values["joint_position"] = self.last
        self.last = values["joint_position"]
        return values


class UntilIsPassed(Twin):
    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        return super().advance(monitor, until + 0.05)


class UntilIsCutShort(Twin):
    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        return super().advance(monitor, until - 0.05)


class MotionsShareANumber(Twin):
    def begin(self, action: Action, decided: PlannedMotion | None = None) -> MotionHandle | MotionCompletion:
        self._motion_count = 0
        return super().begin(action, decided)


class CompletedWithAReason(Twin):
    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        over = super().advance(monitor, until)
        return {one: replace(how, reason=how.reason or "all went well") for one, how in over.items()}


class SkillsThatMove(Twin):
    def skill_ended(self, skill: str, *, finished: bool) -> None:
        self.creep()


class RulesAreHeededATickLater(Twin):
    """A plant that obeys the monitor one tick late."""

    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        before: str | None = None

        def late(now: float, values: Mapping[str, Any]) -> str | None:
            nonlocal before
            heeded, before = before, monitor(now, values)
            return heeded

        return super().advance(late, until)


class RulesEndOneMotion(Twin):
    """A rule ends the first motion alone; the ends of the others are not reported."""

    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        over = super().advance(monitor, until)
        return {min(over): over[min(over)]} if over else over


class RulesLetEverythingCoast(Twin):
    """A rule ends everything, a fifth of a second later."""

    def _come_to_rest(self, ask: Callable[[], str | None]) -> None:
        for _ in range(48):
            self._set_motors()
            self._tick(stopping=True)
            ask()
        super()._come_to_rest(ask)


class StopsAreNotWatched(Twin):
    """Once a rule was named, the monitor is asked no more."""

    def _come_to_rest(self, ask: Callable[[], str | None]) -> None:
        super()._come_to_rest(lambda: None)


class RestIsInstant(Twin):
    """Coming to rest heeds no limit: the arm stands at once."""

    def _brake(self, parts: Collection[str]) -> Iterator[None]:
        self._robot.hold()
        yield


class HaltsEndEverything(Twin):
    def halt(self, motion: MotionHandle) -> None:
        for one in self._under_way:
            super().halt(one)


class HaltsInsideAreRefused(Twin):
    looking = False

    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        self.looking = True
        try:
            return super().advance(monitor, until)
        finally:
            self.looking = False

    def halt(self, motion: MotionHandle) -> None:
        if self.looking:
            raise RuntimeError("not now")
        super().halt(motion)


class StopForgetsWhatWaits(Twin):
    """`stop` brings the robot to rest, and motions that moved nothing go on."""

    def stop(self) -> None:
        waiting = {motion: one for motion, one in self._under_way.items() if not one.moved_parts}
        super().stop()
        self._under_way.update(waiting)


class FeedbackLeavesItsPaths(Twin):
    """In contact it is where it likes to be."""

    def _fast_values(self) -> dict[str, Any]:
        values = super()._fast_values()
        if values["contact_force"] > 3.0:
            values["joint_position"] = tuple(q + 0.02 for q in values["joint_position"])
        return values


class FeedbackIsFasterThanStated(Twin):
    """A quarter of the tool's true speed is stated in the plan."""

    def plan(self, action: Action) -> PlannedMotion:
        plan = super().plan(action)
        if not isinstance(plan, Trajectory) or plan.servo is None or self._planned is None:
            return plan
        lie = replace(plan, servo=replace(plan.servo, tool_speed=plan.servo.tool_speed / 4.0))
        self._planned = (self._planned[0], self._planned[1]._replace(plan=lie))
        return lie


class FeedbackIsNotStated(Twin):
    def plan(self, action: Action) -> PlannedMotion:
        plan = super().plan(action)
        is_pressing = action.kind == "slide"
        return replace(plan, servo=None) if is_pressing and isinstance(plan, Trajectory) else plan


class OnItsCarriage(Twin):
    def __init__(self) -> None:
        super().__init__("fetch")


class OneAtATime(OnItsCarriage):
    """The base stands as long as the arm moves, and then goes on."""

    def _set_motors(self) -> dict[MotionHandle, MotionCompletion]:
        waiting = dict(list(self._under_way.items())[:-1])
        for motion in waiting:
            del self._under_way[motion]
        ended = super()._set_motors()
        self._under_way = {**waiting, **self._under_way}
        return ended


class RulesEndTheArmAlone(OnItsCarriage):
    """A rule ends everything, and the base rolls on."""

    rolls = np.zeros(2)

    def _come_to_rest(self, ask: Callable[[], str | None]) -> None:
        self.rolls = self._robot.base_speed_command
        super()._come_to_rest(ask)

    def _step_world(self) -> None:
        self._robot.base_command = self._robot.base_command + self.rolls * TICK
        super()._step_world()


class CarriageStandsAtOnce(OnItsCarriage):
    """A state of the base that is correct for every speed."""

    def _come_to_rest(self, ask: Callable[[], str | None]) -> None:
        self._robot.hold_base()
        super()._come_to_rest(ask)

    def halt(self, motion: MotionHandle) -> None:
        self._robot.hold_base()
        super().halt(motion)


class ClosingTwiceRaises(Twin):
    closed = False

    def close(self) -> None:
        if self.closed:
            raise RuntimeError("closed already")
        self.closed = True


BROKEN: Final[Mapping[str, Mapping[type[Twin], str]]] = {
    "the_clock_never_goes_back": {
        ClockThatIsSetBack: "the clock goes back",
    },
    "readings_are_fresh_and_never_in_the_future": {
        ReadingsOfTheFuture: "which is in the future",
        ReadingsThatAreNeverRenewed: "was moved, but its reading is still of 0",
        ReadingsThatStandStillAtRest: "though nothing moved",
    },
    "readings_are_of_the_types_that_the_port_has": {
        ReadingsThatAreNumPys: "which every gate refuses",
    },
    "the_monitor_may_observe_and_changes_nothing_by_it": {
        ObservingThatMovesWhatIsUnderWay: "ends differently if the monitor observes",
        ReadingsThatWaitForTheEnd: "s for the monitor, of",
    },
    "planning_moves_nothing": {
        PlanThatMoves: "after `plan`: `joint_position` went",
        PlanThatSees: "after `plan`: `object_detected` went",
    },
    "a_planned_motion_begins_where_the_robot_is": {
        PlanFromElsewhere: "rad or m from where the joints are",
    },
    "nothing_moves_before_time_goes_on": {
        BeginThatMoves: "after `begin`: `joint_position` went",
    },
    "a_stale_plan_is_refused": {
        StalePlansAreAccepted: "no longer is was begun",
    },
    "invalid_input_is_rejected_with_a_reason_before_any_motion": {
        BadInputRaises: "makes it raise OverflowError",
        BadInputIsRefusedWithoutAReason: "refused without a reason",
        UnknownParametersAreIgnored: "an unknown parameter is not refused",
    },
    "the_monitor_runs_before_the_first_tick_and_after_each": {
        MonitorLooksAtEverySecondTick: "the monitor did not look for",
        MonitorNeverLooksBefore: "the monitor first looked at",
    },
    "the_executed_motion_is_the_decided_one": {
        AnotherWayThanDecided: "a joint is .* rad or m off its path",
        OffWithoutSayingSo: "a joint is .* rad or m off its path",
        ChainOfIntegers: "`dh_rows` of the plan has 0; it needs finite numbers of the type `float`",
    },
    "no_speed_is_higher_than_decided": {
        FasterThanDecided: "a joint reaches .*; .* was decided",
    },
    "advance_stops_at_until": {
        UntilIsPassed: "it went on until .* beyond",
        UntilIsCutShort: "before `until`",
    },
    "each_motion_has_its_own_number_and_ends_once": {
        MotionsShareANumber: "two motions are 1",
        CompletedWithAReason: "it ended ambiguously",
    },
    "skill_notifications_move_nothing": {
        SkillsThatMove: "after a skill that asked for nothing",
    },
    "a_rule_broken_at_once_prevents_motion": {
        RulesAreHeededATickLater: "named a rule before anything moved, and",
        MonitorNeverLooksBefore: "named a rule before anything moved, and",
    },
    "a_broken_rule_stops_everything_within_one_tick": {
        RulesAreHeededATickLater: "went on as if it had not",
        RulesEndOneMotion: r"of \[1, 2\], \[1\] ended",
        RulesLetEverythingCoast: "the stop took",
        StopsAreNotWatched: "the monitor was not asked for",
        RestIsInstant: "a stop within the limits needs",
        CarriageStandsAtOnce: "a stop within the limits needs",
    },
    "a_halted_motion_comes_to_rest_while_others_go_on": {
        HaltsEndEverything: r"halted; \[2\] ended",
        RestIsInstant: "a stop within the limits needs",
        CarriageStandsAtOnce: "a stop within the limits needs",
    },
    "the_monitor_may_halt_a_motion": {
        HaltsInsideAreRefused: "where the monitor halts a motion",
        HaltsEndEverything: r"halted; \[2\] ended",
    },
    "stop_ends_everything": {
        StopForgetsWhatWaits: "was begun after all had ended",
        RestIsInstant: "a stop within the limits needs",
    },
    "a_servo_motion_stays_near_its_paths": {
        FeedbackLeavesItsPaths: "rad or m beyond its slack",
        FeedbackIsFasterThanStated: "faster than the plan states",
        FeedbackIsNotStated: "is not under feedback",
    },
    "a_broken_rule_stops_contact_within_one_tick": {
        RulesAreHeededATickLater: "went on as if it had not",
        RulesLetEverythingCoast: "the stop took",
        StopsAreNotWatched: "the monitor was not asked for",
    },
    "motions_of_arm_and_base_together_are_each_as_decided": {
        OneAtATime: "have not ended after",
    },
    "a_broken_rule_stops_arm_and_base": {
        RulesEndTheArmAlone: "after both came to rest: `tool_position` went",
    },
    "close_is_idempotent": {
        ClosingTwiceRaises: "closing it twice makes it raise",
    },
}
"""Twins by the name of the check that is to refuse them, each with words of its reason, a pattern."""
