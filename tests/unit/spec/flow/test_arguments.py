"""Arguments of a step: constants, and outputs of earlier steps."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

from aeros.spec.diagnostics.source import Source
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import EnumType, RealType, Type
from aeros.spec.expr.units import LENGTH, NUMBER
from aeros.spec.flow.arguments import Arguments, step_arguments
from aeros.spec.model.composition import OutputReference, Step
from aeros.spec.model.variables import Declared
from tests.unit.agent.dumplings import given_input, skill

SPAN = Source("text", "xxxx").span(0, 1)
UNIT, WIDE = (Fraction(0), Fraction(1)), (Fraction(0), Fraction(9))
REAL = RealType(NUMBER)
MODE = EnumType("Mode", ("idle", "move"))


def declared(name: str, type_: Type = REAL) -> Declared:
    return Declared(t.Variable(name, type_, t.VariableRole.INPUT), SPAN, range=UNIT)


PRESS = replace(
    skill("press"),
    inputs={"force": given_input("force", None, WIDE), "pause": given_input("pause", Fraction(2), WIDE)},
)
LOOK = replace(
    skill("look"), outputs={"weight": declared("weight"), "size": declared("size", RealType(LENGTH))}
)
SKILLS = {"press": PRESS, "look": LOOK}
SEE = Step("see", "look", {}, {}, 0, None, None, SPAN)


def arguments(output: str | None) -> Arguments:
    given = {"force": Fraction(3), "pause": Fraction(2)}
    flows = {} if output is None else {"force": OutputReference("see", output, SPAN)}
    for name in flows:
        del given[name]
    return step_arguments(Step("go", "press", given, flows, 0, None, None, SPAN), {"see": SEE}, SKILLS)


def number(value: int) -> t.Literal:
    return t.Literal(Fraction(value), RealType(NUMBER))


def test_a_constant_is_a_literal_of_the_input_s_type() -> None:
    assert arguments(None) == Arguments({"inputs.force": number(3), "inputs.pause": number(2)}, ())


def test_an_output_of_another_step_is_a_variable_of_that_step_with_the_output_s_range() -> None:
    found = arguments("weight")
    (brought,) = found.variables
    assert (brought.name, brought.range) == ("see.weight", UNIT)
    assert found.terms == {"inputs.force": brought.variable, "inputs.pause": number(2)}


def test_an_output_of_another_type_leaves_the_input_any_value_it_admits() -> None:
    found = arguments("size")
    (brought,) = found.variables
    assert (brought.name, brought.range, brought.variable.type) == ("go.force", WIDE, RealType(NUMBER))
    assert found.terms["inputs.force"] == brought.variable


def test_a_skill_without_inputs_has_no_arguments() -> None:
    assert step_arguments(SEE, {"see": SEE}, SKILLS) == Arguments({}, ())
