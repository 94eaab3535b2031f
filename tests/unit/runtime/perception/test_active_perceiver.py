"""One perceiver: when it is called and with what, and what becomes of its values when it fails."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest

from aeros.runtime.perception.active_perceiver import MAX_SAMPLES, ActivePerceiver
from aeros.runtime.ports import CameraPicture, Reading, Readings
from aeros.runtime.skills.contract import SkillRefusedError
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.perception import PictureRequest
from tests.unit.runtime.perception.kettle import CRASH, PLACE, Scripted, full_site, kettle
from tests.unit.runtime.perception.perceiving import picture

GOOD = {"water_hot": True, "water_level": (0.1, 0.004)}


class Watched:
    """A perceiver, its scripted runs, and the events that it recorded."""

    def __init__(
        self, *answers: Mapping[str, Any] | Exception, ecm: Ecm | None = None, **declared: Any
    ) -> None:
        ecm = ecm or kettle()
        self.runs = Scripted(*answers or (GOOD,))
        self.events: list[tuple[str, Mapping[str, Any]]] = []
        self.one = ActivePerceiver(
            full_site(),
            ecm,
            replace(ecm.perceivers["kettle_view"], **declared),
            self.runs,
            lambda event, details: self.events.append((event, details)),
            lambda: {ecm.id: {"spoon.spoon": {"age": 9.0}}, "other": {"cup.cup": {"age": 1.0}}},
        )

    def update(
        self, now: float, taken: float | None = None, readings: Readings | None = None, **more: CameraPicture
    ) -> dict[str, Reading]:
        pictures = {} if taken is None else {"overhead": picture(taken, (320, 240))}
        self.one.update(now, readings or {}, {**pictures, **more}, 1.0)
        return self.one.values


def measured(now: float) -> dict[str, Reading]:
    return {"tool_position": Reading(PLACE, now)}


def test_values_have_the_time_of_their_picture() -> None:
    watched = Watched()
    assert watched.update(5.0, 4.5) == {
        "kettle.water_hot": Reading(True, 4.5),
        "kettle.water_level": Reading(0.1, 4.5),
    }
    assert watched.events == []


def test_it_is_called_once_for_each_picture() -> None:
    watched = Watched()
    assert watched.update(1.0) == {}
    for now, taken in ((1.0, 1.0), (2.0, 1.0), (3.0, 3.0), (4.0, 3.0)):
        watched.update(now, taken)
    assert [seen.time for seen in watched.runs.views] == [1.0, 3.0]
    assert watched.runs.opened == 1


def test_a_value_that_is_absent_from_the_next_answer_is_unknown() -> None:
    watched = Watched(GOOD, {"filled": False})
    watched.update(1.0, 1.0)
    assert watched.update(2.0, 2.0) == {"kettle.filled": Reading(False, 2.0)}


def test_of_several_pictures_the_oldest_gives_the_time() -> None:
    ecm = kettle()
    access = replace(ecm.requested_access, sensors=ecm.requested_access.sensors | {"side_camera"})
    asked = (PictureRequest("overhead", 8, 6, True), PictureRequest("side", 8, 6, False))
    watched = Watched(ecm=replace(ecm, requested_access=access), pictures=asked)
    assert watched.update(3.0, 3.0) == {}
    side = picture(2.0, (320, 240), "side")
    assert watched.update(3.0, 3.0, side=side)["kettle.water_hot"] == Reading(True, 2.0)
    assert set(watched.runs.views[0].pictures) == {"overhead", "side"}


@pytest.mark.parametrize("taken", [5.001, float("nan"), float("inf"), -float("inf")])
def test_a_picture_without_a_time_that_has_come_is_not_shown(taken: float) -> None:
    watched = Watched()
    assert watched.update(5.0, taken) == {}
    assert watched.runs.views == []


def test_a_camera_whose_sensor_the_module_lacks_is_withheld() -> None:
    ecm = kettle()
    blind = replace(ecm, requested_access=replace(ecm.requested_access, sensors=frozenset()))
    watched = Watched(ecm=blind)
    assert watched.update(1.0, 1.0) == {}
    assert watched.runs.views == []


@pytest.mark.parametrize("asked", [("overhead", 641, 1), ("overhead", 1, 481), ("attic", 1, 1)])
def test_a_picture_or_reading_that_the_site_does_not_offer_is_withheld(asked: tuple[str, int, int]) -> None:
    watched = Watched(pictures=(PictureRequest(*asked, False),))
    assert watched.update(1.0, 1.0, attic=picture(1.0, (8, 6), "attic")) == {}
    assert watched.runs.views == []


def test_readings_are_shown_while_they_are_fresh_under_the_names_of_the_module() -> None:
    watched = Watched(
        read_as={
            "tool_position": "tool_position",
            "water_level": "kettle.water_level",
            "human_distance": "human_distance",
        }
    )
    readings = {
        "tool_position": Reading(PLACE, 5.0),
        "kettle.water_level": Reading(0.2, 4.0),
        "human_distance": Reading(9.0, 5.0),  # of a sensor that the module has not
        "holding": Reading(False, 5.0),  # not asked for
    }
    watched.update(5.0, 5.0, readings)
    assert watched.runs.views[0].readings == {"tool_position": PLACE, "water_level": 0.2}
    watched.update(66.0, 66.0, readings)
    assert watched.runs.views[1].readings == {}


def test_parameters_are_shown_with_the_readings() -> None:
    watched = Watched(constants={"rows": 2.0}, read_as={"tool_position": "tool_position"})
    watched.update(5.0, 5.0, {"tool_position": Reading(PLACE, 5.0)})
    assert watched.runs.views[0].readings == {"tool_position": PLACE, "rows": 2.0}


def test_without_pictures_it_is_called_whenever_time_has_passed() -> None:
    watched = Watched(pictures=())
    for now in (1.0, 1.0, 1.5, 1.5):
        watched.update(now, None, measured(now))
    assert [seen.time for seen in watched.runs.views] == [1.0, 1.5]
    assert watched.one.values["kettle.water_hot"] == Reading(True, 1.5)


def test_without_pictures_its_rate_bounds_its_calls() -> None:
    watched = Watched(pictures=(), rate=Fraction(2))
    for now in (0.1, 0.4, 0.6, 0.9, 1.0, 1.4, 3.0):
        watched.update(now, None, measured(now))
    assert [seen.time for seen in watched.runs.views] == [0.1, 0.6, 1.0, 3.0]


# Samples.


def test_readings_are_sampled_at_its_rate_between_two_calls() -> None:
    watched = Watched(rate=Fraction(10))
    assert watched.one.needs_sampling
    for tick in range(240):
        now = tick / 240
        watched.one.sample(now, {"tool_position": (0.0, 0.0, now)}, dict)
    watched.update(1.0, 1.0)
    (taken,) = watched.runs.views[0].samples.values()
    assert [time for time, _ in taken] == pytest.approx([0.1 * n for n in range(10)])
    assert all(value == (0.0, 0.0, time) for time, value in taken)
    watched.update(2.0, 2.0)
    assert watched.runs.views[1].samples == {"tool_position": ()}


def test_variables_outside_ticks_are_observed_and_stale_or_repeated_readings_left_out() -> None:
    watched = Watched(rate=Fraction(10))
    observed: list[Reading] = [
        Reading(PLACE, 0.0),
        Reading(PLACE, 0.0),
        Reading(PLACE, 0.19),
        Reading(PLACE, 0.19),
    ]
    for now in (0.0, 0.1, 0.2, 9.0):
        watched.one.sample(now, {"grip_force": 0.0}, lambda: {"tool_position": observed.pop(0)})
    watched.update(9.0, 9.0)
    assert watched.runs.views[0].samples == {"tool_position": ((0.0, PLACE), (0.19, PLACE))}
    assert observed == []


def test_the_newest_samples_are_kept() -> None:
    watched = Watched(rate=Fraction(1000))
    for tick in range(MAX_SAMPLES + 5):
        watched.one.sample(tick / 1000, {"tool_position": PLACE}, dict)
    watched.update(2.0, 2.0)
    taken = watched.runs.views[0].samples["tool_position"]
    assert len(taken) == MAX_SAMPLES
    assert taken[-1][0] == (MAX_SAMPLES + 4) / 1000


def test_sensors_that_the_module_lacks_are_not_sampled() -> None:
    watched = Watched(rate=Fraction(10), read_as={"human_distance": "human_distance"})
    watched.one.sample(0.0, {"human_distance": 3.0}, dict)
    watched.update(1.0, 1.0)
    assert watched.runs.views[0].samples == {"human_distance": ()}


def test_without_a_rate_nothing_is_sampled() -> None:
    watched = Watched()
    assert not watched.one.needs_sampling
    watched.update(1.0, 1.0)
    assert watched.runs.views[0].samples == {}


# Failures.


@pytest.mark.parametrize("failure", [CRASH, SkillRefusedError("no worker")])
def test_a_failure_leaves_its_values_unknown_and_is_recorded(failure: Exception) -> None:
    watched = Watched(GOOD, failure)
    watched.update(1.0, 1.0)
    assert watched.update(2.0, 2.0) == {}
    assert watched.events == [
        (
            "perceiver-failed",
            {
                "module": "kettle",
                "perceiver": "kettle_view",
                "reason": str(failure),
                "at": 2.0,
                "failures": 1,
                "not_before": 2.5,
                "unknown": ["kettle.filled", "kettle.water_hot", "kettle.water_level"],
            },
        )
    ]
    assert watched.runs.closed == 1


def test_it_is_started_again_for_a_new_picture_after_a_pause_that_doubles_up_to_a_bound() -> None:
    watched = Watched(CRASH)
    times = [n * 0.25 for n in range(1, 601)]
    for now in times:
        watched.update(now, now)
    called = [seen.time for seen in watched.runs.views]
    assert called == [0.25, 0.75, 1.75, 3.75, 7.75, 15.75, 31.75, 61.75, 91.75, 121.75]
    assert len(watched.events) == watched.runs.opened == len(called)


def test_a_picture_on_which_it_failed_is_not_shown_again() -> None:
    watched = Watched(CRASH, GOOD)
    for now in (1.0, 2.0, 3.0):
        assert watched.update(now, 1.0) == {}
    assert len(watched.runs.views) == 1


def test_a_picture_that_came_during_the_pause_is_shown_after_it() -> None:
    watched = Watched(CRASH, GOOD)
    watched.update(1.0, 1.0)
    assert watched.update(1.2, 1.2) == {}
    assert watched.update(1.5, 1.2)["kettle.water_hot"] == Reading(True, 1.2)


def test_a_value_that_becomes_uncertain_or_certain_again_is_recorded_once() -> None:
    vague = {"water_hot": True, "water_level": (0.1, 1.0)}
    watched = Watched(vague, vague, GOOD)
    for now in (1.0, 2.0, 3.0):
        watched.update(now, now)
    (first, vaguely), (second, surely) = watched.events
    assert (first, second, surely["uncertainties"]) == ("perceiver-unsure", "perceiver-unsure", {})
    assert vaguely["uncertainties"].keys() == {"kettle.water_level"}
    assert "declared at most" in vaguely["uncertainties"]["kettle.water_level"]


def test_after_an_answer_the_pause_is_short_again_and_the_recovery_is_recorded() -> None:
    watched = Watched(CRASH, CRASH, GOOD, CRASH)
    for now in (1.0, 2.0, 4.0, 5.0):
        watched.update(now, now)
    events = [
        (event, details.get("failures", details.get("after_failures"))) for event, details in watched.events
    ]
    assert events == [
        ("perceiver-failed", 1),
        ("perceiver-failed", 2),
        ("perceiver-recovered", 2),
        ("perceiver-failed", 1),
    ]


def test_an_answer_that_is_not_as_declared_is_a_failure_of_a_perceiver_that_goes_on() -> None:
    watched = Watched(GOOD, {"water_hot": True, "water_level": (0.31, 0.001)}, GOOD)
    watched.update(1.0, 1.0)
    assert watched.update(2.0, 2.0) == {}
    ((event, details),) = watched.events
    assert event == "perceiver-failed"
    wrong = "it measured 0.31 in SI units: `kettle.water_level` is outside 0 m to 0.3 m"
    assert details["reason"] == wrong
    assert watched.update(3.0, 3.0) != {}
    assert (watched.runs.opened, watched.runs.closed) == (1, 0)


def test_its_timeout_is_declared_but_at_least_the_given_one() -> None:
    watched = Watched()
    watched.update(1.0, 1.0)
    watched.one.update(2.0, {}, {"overhead": picture(2.0, (320, 240))}, 0.0)
    assert watched.runs.limits == [1.0, 0.2]


def test_a_closed_perceiver_knows_nothing() -> None:
    watched = Watched()
    watched.update(1.0, 1.0)
    watched.one.close()
    watched.one.close()
    assert watched.one.values == {}
    assert watched.runs.closed == 1


@pytest.mark.parametrize("recalls", [True, False])
def test_only_a_perceiver_that_asks_for_memory_gets_that_of_its_module(recalls: bool) -> None:
    watched = Watched(recalls=recalls)
    watched.update(1.0, 1.0)
    (view,) = watched.runs.views
    assert view.readings.get("memory") == ({"spoon.spoon": {"age": 9.0}} if recalls else None)
