"""Every plant of ours keeps every promise of its port."""

from __future__ import annotations

import pytest

from aeros.sim.conformance.suite import CHECKS, Check
from tests.unit.sim.conformance.subjects import PHYSICAL, SUBJECTS

each_check = pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)


@each_check
@pytest.mark.parametrize("name", SUBJECTS)
def test_a_plant_without_physics_conforms(name: str, check: Check) -> None:
    check(SUBJECTS[name])


@each_check
@pytest.mark.physics
@pytest.mark.parametrize("name", PHYSICAL)
def test_the_physics_plant_conforms(name: str, check: Check) -> None:
    check(PHYSICAL[name])
