"""Measured values become messages; unmeasured values become nothing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pytest

from aeros.runtime.bus.measurement_messages import (
    joint_families,
    motion_joints,
    point_message,
    position_variables,
    scalar_message,
    scalar_variables,
)
from aeros.runtime.bus.messages import (
    BoolStamped,
    Float64Stamped,
    Header,
    JointState,
    Point,
    PointStamped,
    StringStamped,
    Time,
)
from aeros.runtime.ports import Reading
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import (
    BOOL,
    EnumType,
    FamilyType,
    IntegerType,
    RealType,
    Type,
    VectorType,
)
from aeros.spec.expr.units import ANGLE, FORCE, LENGTH, TIME, Dimension
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path
from tests.unit.runtime.conftest import declare

JOINTS = EnumType("joints", ("shoulder", "elbow"))
CELLS = EnumType("cells", ("left", "right"))
TORQUE = FORCE * LENGTH


def family(dimension: Dimension, index: EnumType = JOINTS) -> FamilyType:
    return FamilyType(index, RealType(dimension))


def speaking(site: Site, types: Mapping[str, Type]) -> Site:
    return replace(
        site, state={name: declare(name, one, t.VariableRole.STATE) for name, one in types.items()}
    )


def states(site: Site, values: Mapping[str, Any], time: float = 2.5) -> list[JointState]:
    readings = {name: Reading(value, time) for name, value in values.items()}
    return [message for joints in joint_families(site) for message in joints.joint_state_messages(readings)]


def test_families_are_distinguished_by_dimension(site: Site) -> None:
    site = speaking(site, {"load": family(TORQUE), "angle": family(ANGLE), "rate": family(ANGLE * TIME**-1)})
    values = {"angle": (1.0, 2.0), "rate": (3.0, 4.0), "load": (5.0, 6.0)}
    assert states(site, values) == [
        JointState(Header(Time(2, 500_000_000)), ("shoulder", "elbow"), (1.0, 2.0), (3.0, 4.0), (5.0, 6.0))
    ]


def test_unmeasured_fields_are_left_empty(site: Site) -> None:
    site = speaking(site, {"angle": family(ANGLE), "rate": family(ANGLE * TIME**-1)})
    (message,) = states(site, {"rate": (3.0, 4.0)})
    assert (message.position, message.velocity, message.effort) == ((), (3.0, 4.0), ())
    assert states(site, {}) == []


def test_values_measured_at_two_times_become_two_messages(site: Site) -> None:
    site = speaking(site, {"angle": family(ANGLE), "rate": family(ANGLE * TIME**-1)})
    (joints,) = joint_families(site)
    found = list(
        joints.joint_state_messages({"angle": Reading((1.0, 2.0), 3.0), "rate": Reading((0.0, 0.0), 1.0)})
    )
    assert [(one.header.stamp.sec, one.position, one.velocity) for one in found] == [
        (1, (), (0.0, 0.0)),
        (3, (1.0, 2.0), ()),
    ]


def test_lengths_over_an_index_are_no_joints(site: Site) -> None:
    assert (
        joint_families(speaking(site, {"height": family(LENGTH, CELLS), "pull": family(TORQUE, CELLS)})) == []
    )


def test_an_ambiguous_position_is_left_empty(site: Site) -> None:
    site = speaking(site, {"angle": family(ANGLE), "other": family(ANGLE), "rate": family(ANGLE * TIME**-1)})
    (message,) = states(site, {"angle": (1.0, 2.0), "other": (3.0, 4.0), "rate": (5.0, 6.0)})
    assert (message.position, message.velocity) == ((), (5.0, 6.0))


def test_places_are_vectors_of_length(site: Site) -> None:
    site = speaking(site, {"hand": VectorType(LENGTH), "pull": VectorType(TORQUE), "gap": RealType(LENGTH)})
    assert position_variables(site) == ["hand"]
    assert point_message(Reading((1.0, 2.0, 3.0), 0.5)) == PointStamped(
        Header(Time(0, 500_000_000), "world"), Point(1.0, 2.0, 3.0)
    )


@pytest.mark.parametrize("value", [(), (1.0,), (1.0, 2.0), (1.0, 2.0, 3.0, 4.0), None])
def test_a_place_without_three_coordinates_is_no_message(value: Any) -> None:
    with pytest.raises((ValueError, TypeError)):
        point_message(Reading(value, 0.5))


def test_bools_numbers_and_enums_have_messages_of_their_types(site: Site) -> None:
    types: dict[str, Type] = {"open": BOOL, "gap": RealType(LENGTH), "count": IntegerType(), "cell": CELLS}
    site = speaking(site, {**types, "place": VectorType(LENGTH), "angle": family(ANGLE)})
    kinds = scalar_variables(site)
    assert kinds == {
        "open": BoolStamped,
        "gap": Float64Stamped,
        "count": Float64Stamped,
        "cell": StringStamped,
    }
    sent = [
        scalar_message(Reading(value, 0.5), kinds[name])
        for name, value in {"open": True, "gap": 0.25, "count": 3, "cell": "left"}.items()
    ]
    header = Header(Time(0, 500_000_000))
    assert sent == [
        BoolStamped(header, True),
        Float64Stamped(header, 0.25),
        Float64Stamped(header, 3.0),
        StringStamped(header, "left"),
    ]


@pytest.fixture(scope="module")
def reference() -> Site:
    found = load_site(reference_site_path(), Diagnostics())
    assert found is not None
    return found


def test_the_motion_policy_names_the_joints_of_the_chain(site: Site, reference: Site) -> None:
    names = tuple(f"j{number}" for number in range(1, 8))
    assert motion_joints(reference) == ("joint_position", names)
    assert motion_joints(site) is None
    state = {
        **reference.state,
        "aim": declare("aim", reference.state["joint_position"].variable.type, t.VariableRole.STATE),
    }
    q = (0.0,) * 7
    (message,) = states(replace(reference, state=state), {"aim": (1.0,) * 7, "joint_position": q})
    assert message.position == q
