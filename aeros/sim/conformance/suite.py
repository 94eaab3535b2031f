"""The list of all checks; `docs/plants.md` shows how to hold a robot's adapter to them.

Each raises `ConformanceError`, an AssertionError, if the plant breaks the promise of its name.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from aeros.sim.conformance.contact_checks import (
    a_broken_rule_stops_arm_and_base,
    a_broken_rule_stops_contact_within_one_tick,
    a_servo_motion_stays_near_its_paths,
    motions_of_arm_and_base_together_are_each_as_decided,
)
from aeros.sim.conformance.motion_checks import (
    advance_stops_at_until,
    each_motion_has_its_own_number_and_ends_once,
    no_speed_is_higher_than_decided,
    skill_notifications_move_nothing,
    the_executed_motion_is_the_decided_one,
)
from aeros.sim.conformance.observation_checks import (
    readings_are_fresh_and_never_in_the_future,
    readings_are_of_the_types_that_the_port_has,
    the_clock_never_goes_back,
    the_monitor_may_observe_and_changes_nothing_by_it,
    the_monitor_runs_before_the_first_tick_and_after_each,
)
from aeros.sim.conformance.picture_checks import a_look_brings_a_new_picture_of_its_own_time
from aeros.sim.conformance.plant_under_test import ConformanceError, PlantUnderTest
from aeros.sim.conformance.rejection_checks import (
    a_planned_motion_begins_where_the_robot_is,
    a_stale_plan_is_refused,
    invalid_input_is_rejected_with_a_reason_before_any_motion,
    nothing_moves_before_time_goes_on,
    planning_moves_nothing,
)
from aeros.sim.conformance.stop_checks import (
    a_broken_rule_stops_everything_within_one_tick,
    a_halted_motion_comes_to_rest_while_others_go_on,
    a_rule_broken_at_once_prevents_motion,
    close_is_idempotent,
    stop_ends_everything,
    the_monitor_may_halt_a_motion,
)

__all__ = ["CHECKS", "ConformanceError", "PlantUnderTest"]

Check = Callable[[PlantUnderTest], None]

CHECKS: Final[tuple[Check, ...]] = (
    the_clock_never_goes_back,
    readings_are_fresh_and_never_in_the_future,
    readings_are_of_the_types_that_the_port_has,
    planning_moves_nothing,
    a_planned_motion_begins_where_the_robot_is,
    nothing_moves_before_time_goes_on,
    a_stale_plan_is_refused,
    invalid_input_is_rejected_with_a_reason_before_any_motion,
    the_monitor_runs_before_the_first_tick_and_after_each,
    the_monitor_may_observe_and_changes_nothing_by_it,
    a_look_brings_a_new_picture_of_its_own_time,
    the_executed_motion_is_the_decided_one,
    no_speed_is_higher_than_decided,
    advance_stops_at_until,
    each_motion_has_its_own_number_and_ends_once,
    skill_notifications_move_nothing,
    a_rule_broken_at_once_prevents_motion,
    a_broken_rule_stops_everything_within_one_tick,
    a_halted_motion_comes_to_rest_while_others_go_on,
    the_monitor_may_halt_a_motion,
    stop_ends_everything,
    a_servo_motion_stays_near_its_paths,
    a_broken_rule_stops_contact_within_one_tick,
    motions_of_arm_and_base_together_are_each_as_decided,
    a_broken_rule_stops_arm_and_base,
    close_is_idempotent,
)
"""Every check, in the order of the port's methods."""
