"""A small vocabulary for tests of the expression language."""

from __future__ import annotations

from fractions import Fraction

from aeros.spec.expr import terms as t
from aeros.spec.expr.parser import parse
from aeros.spec.expr.random_terms import JOINT, MODE, VARIABLES
from aeros.spec.expr.scope import AxisAlignedBox, Scope
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.types import BOOL, EnumType, FamilyType, RealType, Type, VectorType
from aeros.spec.expr.units import LENGTH, NUMBER, TIME

GRIP = EnumType("Grip", ("open", "stop"))
SPEED = RealType(LENGTH * TIME**-1)
_METRES = RealType(LENGTH)
_ZERO = t.Literal(Fraction(0), _METRES)
SCOPE = Scope(
    variables={
        **VARIABLES,
        "speed": t.Variable("speed", SPEED, t.VariableRole.PARAMETER),
        "k": t.Variable("k", RealType(NUMBER), t.VariableRole.STATE),
        "v": t.Variable("v", VectorType(SPEED.dimension), t.VariableRole.STATE),
        "grip": t.Variable("grip", GRIP, t.VariableRole.STATE),
    },
    inputs={
        "pace": t.Variable("inputs.pace", SPEED, t.VariableRole.INPUT),
        "grip": t.Variable("inputs.grip", GRIP, t.VariableRole.INPUT),
    },
    constants={
        "reach": t.Literal(Fraction(85, 100), _METRES),
        "home": t.Vector(_ZERO, _ZERO, _ZERO),
        "limit": t.ConstantTable(
            "limit", FamilyType(JOINT, _METRES), (Fraction(1), Fraction(2), Fraction(3))
        ),
    },
    enums={"Joint": JOINT, "Mode": MODE, "Grip": GRIP},
    volumes={"cell": AxisAlignedBox((Fraction(-1),) * 3, (Fraction(1),) * 3)},
)


def term_of(text: str, expected: Type = BOOL) -> t.Term:
    return check(parse(text), SCOPE, expected)
