"""Plants that `aeros check-plant` is asked about by the name of a Python object."""

from __future__ import annotations

from aeros.sim.conformance.plant_under_test import PlantUnderTest
from aeros.sim.fake import FakePlant
from aeros.skill import act
from tests.unit.sim.conformance.subjects import SUBJECTS

GOOD = SUBJECTS["symbolic"]
STANDING = PlantUnderTest(FakePlant, act("move"), act("wait"))


def good() -> PlantUnderTest:
    return GOOD


def fails() -> PlantUnderTest:
    raise OSError("no drive")


def other() -> int:
    return 3


def without_robot() -> PlantUnderTest:
    def make() -> FakePlant:
        raise ConnectionRefusedError("no robot")

    return PlantUnderTest(make, act("move"), act("wait"))
