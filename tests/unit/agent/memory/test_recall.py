"""Perceivers are given the places of things that their module lets them recall, and none that are too old."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from fractions import Fraction

import pytest

from aeros.agent.memory.recall import recalled_places
from aeros.agent.memory.sightings import RememberedValue
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.perception import Thing
from tests.unit.agent.dumplings import DUMPLING

NOW = datetime(2026, 1, 31, tzinfo=UTC)
CUP = Thing("dumpling.cup", "cup", position="dumpling.cup_position")


def remembered(name: str, age_s: float = 60.0) -> RememberedValue:
    seen = (NOW - timedelta(seconds=age_s)).isoformat()
    return RememberedValue(name, [1.0, 2.0, 3.0], seen, 4, "dumpling", 0.01, [0.0, 2.0, 3.0], 3, 5)


def module(recall: Fraction | None) -> Ecm:
    return replace(DUMPLING, things={"cup": replace(CUP, recall=recall)})


def test_a_place_has_its_age_its_uncertainty_and_the_usual_place() -> None:
    names = ("thing dumpling.cup cup position", "thing dumpling.cup cup held", "thing other.cup cup position")
    assert recalled_places(map(remembered, names), [module(Fraction(3600))], NOW, 4) == {
        "dumpling": {
            "cup.cup": {
                "position": (1.0, 2.0, 3.0),
                "age": 60.0,
                "in_session": True,
                "usual": (0.0, 2.0, 3.0),
                "usual_sessions": 3.0,
                "sessions": 5.0,
                "uncertainty": 0.01,
            }
        }
    }


@pytest.mark.parametrize(("age_s", "is_recalled"), [(3600.0, True), (3601.0, False)])
def test_a_place_that_is_too_old_is_not_recalled(age_s: float, is_recalled: bool) -> None:
    place = remembered("thing dumpling.cup cup position", age_s)
    tables = recalled_places([place], [module(Fraction(3600))], NOW, 4)
    assert ("cup.cup" in tables["dumpling"]) is is_recalled


def test_a_thing_without_recall_is_not_recalled() -> None:
    assert recalled_places([remembered("thing dumpling.cup cup position")], [module(None)], NOW, 4) == {}
