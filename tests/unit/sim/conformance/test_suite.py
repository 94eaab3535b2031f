"""The list of checks is complete, and each has a twin that it refuses (test_*_checks.py)."""

from __future__ import annotations

from aeros.sim.conformance import (
    contact_checks,
    motion_checks,
    observation_checks,
    picture_checks,
    rejection_checks,
    stop_checks,
)
from aeros.sim.conformance.suite import CHECKS
from tests.unit.sim.conformance.broken import BROKEN

WITH_CAMERAS = {"a_look_brings_a_new_picture_of_its_own_time"}
"""Checks whose broken twins have cameras: they are in test_picture_checks.py."""


def test_each_check_has_a_broken_twin() -> None:
    assert set(BROKEN) | WITH_CAMERAS == {check.__name__ for check in CHECKS}


def test_every_public_check_of_a_plant_is_in_the_list_once() -> None:
    modules = (
        contact_checks,
        motion_checks,
        observation_checks,
        picture_checks,
        rejection_checks,
        stop_checks,
    )
    checks = {
        one
        for module in modules
        for one in vars(module).values()
        if getattr(one, "__module__", "") == module.__name__
        and getattr(one, "__annotations__", {}) == {"subject": "PlantUnderTest", "return": "None"}
        and not one.__name__.startswith("_")
    }
    assert set(CHECKS) == checks
    assert len(CHECKS) == len(checks) == 26
