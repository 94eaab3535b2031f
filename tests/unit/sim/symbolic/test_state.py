"""Initial values: harmless, of the declared types, and inside every range."""

from __future__ import annotations

from fractions import Fraction
from math import nextafter, pi
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from aeros.sim.robot.kinematics import forward_kinematics
from aeros.sim.robot.robot_file import robot_of
from aeros.sim.symbolic.state import answers_of_tools, as_reading, initial_values
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.elaborate.load import load_site
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, EnumType, FamilyType, RealType, Type, VectorType
from aeros.spec.expr.units import LENGTH, NUMBER
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from tests.repo.tree import ROOT
from tests.unit.runtime.conftest import declare

JOINTS = EnumType("joints", tuple(f"j{number}" for number in range(1, 8)))
CELLS = EnumType("cells", ("a", "b"))
METRES = RealType(LENGTH)
SITES = sorted((ROOT / "aeros" / "sites").glob("*.yaml"))


def state(name: str, type_: Type, low: str | None = "-10", high: str = "10") -> Declared:
    bounds = None if low is None else (Fraction(low), Fraction(high))
    return declare(name, type_, t.VariableRole.STATE, range=bounds)


def initial(*declared: Declared, **given: Any) -> dict[str, Any]:
    site = cast("Site", SimpleNamespace(robot=None, state={one.name: one for one in declared}))
    return initial_values(site, given)


def test_truths_are_false_and_enums_their_first_member() -> None:
    assert initial(state("open", BOOL, None), state("mode", CELLS, None)) == {"open": False, "mode": "a"}
    assert initial(state("cells", FamilyType(CELLS, BOOL), None)) == {"cells": (False, False)}


def test_an_answer_of_a_tool_has_no_value_unless_one_is_given() -> None:
    tool = SimpleNamespace(answers=("entries", "price"))
    kinds = {"ask": SimpleNamespace(tool=tool), "move": SimpleNamespace(tool=None)}
    site = cast("Site", SimpleNamespace(kinds=kinds))
    assert answers_of_tools(site, {"price": 3.0}) == {"entries"}
    assert answers_of_tools(site, {}) == {"entries", "price"}


def test_numbers_are_0_or_the_nearest_in_their_range() -> None:
    assert initial(state("load", METRES)) == {"load": 0.0}
    assert initial(state("load", METRES, None)) == {"load": 0.0}
    assert initial(state("load", METRES, "3", "5")) == {"load": 3.0}
    assert initial(state("load", METRES, "-5", "-3")) == {"load": -3.0}
    # A double inside the range: 280.1 as a double is above it or the next one is.
    (value,) = initial(state("load", METRES, "280.1", "400")).values()
    assert Fraction(value) >= Fraction("280.1")
    assert value <= nextafter(280.1, 400.0)


def test_known_names_have_their_usual_values() -> None:
    found = initial(
        state("joint_position", FamilyType(JOINTS, RealType(NUMBER))),
        state("tool_position", VectorType(LENGTH)),
        state("base_position", VectorType(LENGTH)),
        state("finger_gap", METRES, "0", "0.07"),
        state("human_distance", METRES, "0", "30"),
    )
    assert found["joint_position"] == pytest.approx((0, -pi / 4, 0, -3 * pi / 4, 0, pi / 2, pi / 4))
    assert found["tool_position"] == (0.307, 0.0, 0.487)
    assert found["base_position"] == (0.0, 0.0, 0.0)
    assert found["finger_gap"] <= 0.07
    assert found["finger_gap"] == pytest.approx(0.07)
    assert found["human_distance"] == 20.0


def test_other_places_are_in_front_of_the_arm_and_other_vectors_zero() -> None:
    assert initial(state("cup", VectorType(LENGTH))) == {"cup": (0.45, 0.0, 0.15)}
    assert initial(state("pull", VectorType(NUMBER))) == {"pull": (0.0, 0.0, 0.0)}
    assert initial(state("cup", VectorType(LENGTH), "-1/10", "1/8"))["cup"] == pytest.approx(
        (0.125, 0.0, 0.125)
    )


def test_a_known_name_of_another_size_is_zero() -> None:
    assert initial(state("joint_position", FamilyType(CELLS, RealType(NUMBER)))) == {
        "joint_position": (0.0, 0.0)
    }
    assert initial(state("tool_position", METRES)) == {"tool_position": 0.0}


def test_given_values_are_taken_as_a_sensor_reads_them() -> None:
    found = initial(
        state("load", METRES, "0", "1/10"), state("open", BOOL, None), state("cup", VectorType(LENGTH)),
        load=Fraction(1, 10), open=True, cup=(Fraction(1, 2), Fraction(0), Fraction(1)),
    )  # fmt: skip
    # 0.1 as a double is above 1/10.
    assert found == {"load": nextafter(0.1, 0.0), "open": True, "cup": (0.5, 0.0, 1.0)}


def test_an_unknown_name_is_misuse() -> None:
    with pytest.raises(MisuseError, match="`aim` is not a state variable of the site"):
        initial(state("load", METRES), zeal=1.0, aim=2.0)


def test_exact_values_become_doubles_inside_their_range() -> None:
    tenth = state("x", METRES, "-1/10", "1/10")
    assert as_reading(Fraction(1, 10), tenth) == nextafter(0.1, 0.0)
    assert as_reading(Fraction(-1, 10), tenth) == -nextafter(0.1, 0.0)
    third = as_reading((Fraction(1, 3), True, "word", 0.25), state("x", METRES, None))
    assert third == (1 / 3, True, "word", 0.25)
    assert type(third[0]) is float


@pytest.mark.parametrize(
    "path", sorted((ROOT / "aeros" / "sites").glob("*.yaml")), ids=lambda path: path.stem
)
def test_the_robot_of_a_site_begins_in_its_ready_posture(path: Path) -> None:
    site = load_site(path, Diagnostics())
    assert site is not None
    values, robot = initial_values(site, {}), robot_of(site)
    assert values["joint_position"] == pytest.approx(robot.postures.ready.tolist())
    tool, _, _ = forward_kinematics(robot, robot.postures.ready[None, :])
    assert values["tool_position"] == pytest.approx(tool[0].tolist(), abs=1e-3)
    assert site.motion is not None
    within = zip(site.motion.lowest, values["joint_position"], site.motion.highest, strict=True)
    assert all(low < position < high for low, position, high in within)
