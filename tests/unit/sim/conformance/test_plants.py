"""Every plant of ours keeps every promise of its port."""

from __future__ import annotations

from collections.abc import Iterable

import pytest

from aeros.sim.conformance.contact_checks import (
    a_broken_rule_stops_contact_within_one_tick,
    a_servo_motion_stays_near_its_paths,
)
from aeros.sim.conformance.stop_checks import a_broken_rule_stops_everything_within_one_tick
from aeros.sim.conformance.suite import CHECKS, Check
from tests.unit.sim.conformance.subjects import ON_MUJOCO, PHYSICAL, SUBJECTS

_IN_CONTACT = {
    a_servo_motion_stays_near_its_paths.__name__,
    a_broken_rule_stops_contact_within_one_tick.__name__,
}
"""Checks that look at `pressing` alone, and take longest."""

_PRESSING_AS_ANOTHER = {"watched", "kinematic, joint by joint", "physics, joint by joint"}
"""Subjects that press as `kinematic` and `physics` do: they differ in what these checks do not look at."""

_AS_ANOTHER = {"watched", "physics, joint by joint"}
"""Subjects with the motions of `kinematic, joint by joint`, in another plant."""

_NIGHTLY = {
    "kinematic on a base that turns",
    "physics on a linear axis",
    "physics on a base that turns",
    "kinematic with a second arm",
    "physics with a second arm",
}
"""Subjects whose every check is `deep`."""


def _each_check_of(names: Iterable[str]) -> pytest.MarkDecorator:
    """Pair every subject with every check; pairs that repeat another, or take long, are `deep`."""
    pairs = []
    for name in names:
        for check in CHECKS:
            is_repeated = (
                name in _AS_ANOTHER
                or name in _NIGHTLY
                or (name in _PRESSING_AS_ANOTHER and check.__name__ in _IN_CONTACT)
                or (name == "hosted" and check is a_broken_rule_stops_contact_within_one_tick)
            )
            marks = pytest.mark.deep if is_repeated else ()
            pairs.append(pytest.param(name, check, id=f"{name}-{check.__name__}", marks=marks))
    return pytest.mark.parametrize(("name", "check"), pairs)


@_each_check_of(SUBJECTS)
def test_a_plant_without_physics_conforms(name: str, check: Check) -> None:
    check(SUBJECTS[name])


@_each_check_of(PHYSICAL)
@pytest.mark.physics
def test_the_physics_plant_conforms(name: str, check: Check) -> None:
    check(PHYSICAL[name])


@pytest.mark.parametrize(
    "check", [a_servo_motion_stays_near_its_paths, a_broken_rule_stops_everything_within_one_tick]
)
@pytest.mark.physics
def test_the_physics_plant_presses_and_stops_on_mujoco(check: Check) -> None:
    check(ON_MUJOCO["mujoco"])


@_each_check_of(ON_MUJOCO)
@pytest.mark.deep
@pytest.mark.physics
def test_the_physics_plant_conforms_on_mujoco(name: str, check: Check) -> None:
    check(ON_MUJOCO[name])
