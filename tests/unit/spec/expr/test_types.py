"""Types compare by value and are shown as in diagnostics."""

from __future__ import annotations

from aeros.spec.expr.types import BOOL, BoolType, EnumType, FamilyType, IntegerType, RealType, VectorType
from aeros.spec.expr.units import LENGTH, NUMBER, TIME

JOINT = EnumType("Joint", ("j1", "j2"))


def test_a_type_is_shown_with_its_unit() -> None:
    assert str(BOOL) == "bool"
    assert str(RealType(LENGTH * TIME**-1)) == "real [m/s]"
    assert str(RealType(NUMBER)) == "real [1]"
    assert str(IntegerType()) == "int"
    assert str(VectorType(LENGTH)) == "vec3 [m]"
    assert str(JOINT) == "Joint"
    assert str(FamilyType(JOINT, RealType(LENGTH))) == "real [m] for each of Joint"
    assert str(FamilyType(JOINT, BOOL)) == "bool for each of Joint"


def test_types_are_equal_by_value() -> None:
    assert BoolType() == BOOL
    assert RealType(LENGTH) == RealType(LENGTH)
    assert RealType(LENGTH) != RealType(TIME)
    assert EnumType("Joint", ("j1", "j2")) == JOINT
    assert EnumType("Joint", ("j2", "j1")) != JOINT
    assert EnumType("Arm", ("j1", "j2")) != JOINT


def test_a_whole_number_is_a_real_of_no_unit_and_yet_another_type() -> None:
    assert isinstance(IntegerType(), RealType)
    assert IntegerType().dimension == NUMBER
    assert IntegerType() != RealType(NUMBER)
