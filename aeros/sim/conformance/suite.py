"""All checks; `docs/plants.md` shows how a robot's adapter is held to them.

Each raises `ConformanceError`, an AssertionError, where the plant breaks the promise of its name.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from aeros.sim.conformance.contact_checks import (
    a_motion_under_feedback_keeps_near_its_paths,
    a_rule_named_ends_arm_and_base_together,
    a_rule_named_in_contact_ends_it_within_one_tick,
    motions_of_arm_and_base_together_are_each_as_decided,
)
from aeros.sim.conformance.motion_checks import (
    each_motion_has_its_own_number_and_ends_once,
    no_speed_is_higher_than_decided,
    nothing_passes_until,
    skills_that_come_and_go_move_nothing,
    the_motion_made_is_the_one_decided,
)
from aeros.sim.conformance.observation_checks import (
    no_reading_is_of_the_future_and_each_is_taken_anew,
    readings_are_of_the_types_that_the_port_has,
    the_clock_never_goes_back,
    the_monitor_looks_before_the_first_tick_and_after_each,
    the_monitor_may_observe_and_changes_nothing_by_it,
)
from aeros.sim.conformance.plant_under_test import ConformanceError, Subject
from aeros.sim.conformance.rejection_checks import (
    a_planned_motion_begins_where_the_robot_is,
    a_stale_plan_is_refused,
    bad_input_is_refused_with_a_reason_before_any_motion,
    nothing_moves_before_time_goes_on,
    planning_moves_nothing,
)
from aeros.sim.conformance.stop_checks import (
    a_halted_motion_comes_to_rest_while_others_go_on,
    a_named_rule_ends_everything_within_one_tick,
    a_rule_named_at_once_keeps_everything_where_it_is,
    closing_twice_is_closing_once,
    stop_ends_everything,
    the_monitor_may_halt_a_motion,
)

__all__ = ["CHECKS", "ConformanceError", "Subject"]

Check = Callable[[Subject], None]

CHECKS: Final[tuple[Check, ...]] = (
    the_clock_never_goes_back,
    no_reading_is_of_the_future_and_each_is_taken_anew,
    readings_are_of_the_types_that_the_port_has,
    planning_moves_nothing,
    a_planned_motion_begins_where_the_robot_is,
    nothing_moves_before_time_goes_on,
    a_stale_plan_is_refused,
    bad_input_is_refused_with_a_reason_before_any_motion,
    the_monitor_looks_before_the_first_tick_and_after_each,
    the_monitor_may_observe_and_changes_nothing_by_it,
    the_motion_made_is_the_one_decided,
    no_speed_is_higher_than_decided,
    nothing_passes_until,
    each_motion_has_its_own_number_and_ends_once,
    skills_that_come_and_go_move_nothing,
    a_rule_named_at_once_keeps_everything_where_it_is,
    a_named_rule_ends_everything_within_one_tick,
    a_halted_motion_comes_to_rest_while_others_go_on,
    the_monitor_may_halt_a_motion,
    stop_ends_everything,
    a_motion_under_feedback_keeps_near_its_paths,
    a_rule_named_in_contact_ends_it_within_one_tick,
    motions_of_arm_and_base_together_are_each_as_decided,
    a_rule_named_ends_arm_and_base_together,
    closing_twice_is_closing_once,
)
"""Every check, in the order of the port's methods."""
