"""A name refers to the nearest declaration, and a misspelt one gets a suggestion."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest

from aeros.spec.expr import syntax as s
from aeros.spec.expr import terms as t
from aeros.spec.expr.parser import parse
from aeros.spec.expr.random_terms import JOINT, MODE, VARIABLES
from aeros.spec.expr.scope import ExpressionTypeError, Scope
from aeros.spec.expr.semantics import evaluate
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.typecheck.name_resolution import (
    declared_type,
    not_a_member,
    resolve_attribute,
    resolve_name,
    resolve_volume,
    suggest_names,
    value_type,
)
from aeros.spec.expr.types import BOOL, EnumType, FamilyType, IntegerType, RealType, Type, VectorType
from aeros.spec.expr.units import LENGTH, NUMBER
from tests.unit.spec.expr.scope import GRIP, SCOPE, SPEED

EXTENT = s.TextRange(3, 7)


def name(text: str) -> s.Name:
    return s.Name(text, EXTENT)


def resolved(text: str, hint: Type | None = None, **bound: EnumType) -> tuple[t.Term, Type]:
    return resolve_name(name(text), SCOPE, {i: t.BoundVariable(i, set_) for i, set_ in bound.items()}, hint)


def refused(text: str, hint: Type | None = None) -> tuple[str, str | None]:
    with pytest.raises(ExpressionTypeError) as raised:
        resolved(text, hint)
    assert (raised.value.code, raised.value.extent) == ("AE202", EXTENT)
    return raised.value.message, raised.value.cure


def test_the_index_of_a_quantifier_hides_a_variable_of_its_name() -> None:
    assert resolved("x") == (VARIABLES["x"], RealType(LENGTH))
    assert resolved("x", None, x=JOINT) == (t.BoundVariable("x", JOINT), JOINT)


@pytest.mark.parametrize("text", ["place", "m.place"])
def test_a_value_from_memory_is_refused_as_such(text: str) -> None:
    scope = Scope({}, recalled=frozenset({"place", "m.place"}))
    with pytest.raises(ExpressionTypeError) as raised:
        check(parse(text), scope, BOOL)
    assert raised.value.message == f"`{text}` comes from memory, so no condition may read it"


def test_a_constant_has_the_type_of_its_value() -> None:
    assert resolved("reach") == (t.Literal(Fraction(85, 100), RealType(LENGTH)), RealType(LENGTH))
    assert resolved("home")[1] == VectorType(LENGTH)
    assert resolved("limit")[1] == FamilyType(JOINT, RealType(LENGTH))


def test_a_definition_is_its_condition_where_all_that_it_reads_may_be_read() -> None:
    ready, armed = (t.Variable(one, BOOL, t.VariableRole.STATE) for one in ("ready", "armed"))
    both = t.And((ready, armed))
    scope = Scope({"ready": ready, "renamed": armed}, definitions={"both": both})
    assert check(parse("not both"), scope, BOOL) == t.Not(both)
    with pytest.raises(ExpressionTypeError) as raised:
        check(parse("not both"), Scope({"ready": ready}, definitions={"both": both}), BOOL)
    assert raised.value.message == "`both` reads `armed`, which cannot be read here"
    with pytest.raises(ExpressionTypeError) as raised:
        check(parse("not bath"), scope, BOOL)
    assert raised.value.cure == "did you mean `both`?"


def test_a_member_of_one_enum_is_that_member_and_of_several_the_hint_decides() -> None:
    assert resolved("j2") == (t.Literal("j2", JOINT), JOINT)
    assert resolved("open", BOOL) == (t.Literal("open", GRIP), GRIP)
    assert resolved("stop", MODE) == (t.Literal("stop", MODE), MODE)
    assert resolved("stop", GRIP) == (t.Literal("stop", GRIP), GRIP)
    assert refused("stop") == (
        "`stop` is a member of Mode and of Grip",
        "compare it with a variable, which decides the enum: `variable == member`",
    )


def test_a_member_of_another_enum_than_expected_is_refused() -> None:
    assert refused("idle", GRIP) == ("`idle` is not a member of Grip", "Grip is one of `open`, `stop`")
    assert refused("opne", GRIP) == ("`opne` is not a member of Grip", "did you mean `open`?")


def test_a_name_that_is_not_declared_is_refused_with_the_nearest_that_is() -> None:
    assert refused("reech") == ("`reech` is not declared here", "did you mean `reach`?")
    assert refused("speeed")[1] == "did you mean `speed`?"
    assert refused("mowe")[1] == "did you mean `move`?"
    assert refused("nowhere_near") == (
        "`nowhere_near` is not declared here",
        "declare it at the site or in the module's `needs`, or use a parameter of the action (`speed`)",
    )


def test_an_unknown_name_among_parameters_of_an_action_gets_their_names() -> None:
    speed = t.Variable("speed", SCOPE.variables["speed"].type, t.VariableRole.PARAMETER)
    measured = t.Variable("joint_velocity", speed.type, t.VariableRole.STATE)
    scope = Scope({"speed": speed, "joint_velocity": measured})
    cures = []
    for name in ("sped", "velocity", "joint_velocty", "haste"):
        with pytest.raises(ExpressionTypeError) as raised:
            check(parse(f"{name} <= 1 m/s"), scope, BOOL)
        cures.append(raised.value.cure)
    assert cures == [
        "did you mean `speed`?",
        "use a parameter of the action (`speed`); or did you mean `joint_velocity`?",
        "did you mean `joint_velocity`?",
        "declare it at the site or in the module's `needs`, or use a parameter of the action (`speed`)",
    ]


def test_a_name_near_an_index_is_suggested() -> None:
    with pytest.raises(ExpressionTypeError) as raised:
        resolved("elbo", None, elbow=JOINT)
    assert raised.value.cure == "did you mean `elbow`?"


ROLES = Scope({}, roles={"moving": {"speed": SCOPE.variables["speed"]}}, inputs=SCOPE.inputs)


def attribute(base: s.Node, text: str, scope: Scope = ROLES) -> tuple[t.Term, Type] | None:
    return resolve_attribute(s.Attribute(base, name(text), EXTENT), scope, {})


def test_inputs_and_parameters_of_a_role_are_found() -> None:
    assert attribute(name("inputs"), "pace") == (SCOPE.inputs["pace"], SPEED)
    assert attribute(name("moving"), "speed") == (SCOPE.variables["speed"], SPEED)


WATER = t.Variable("pot.water_hot", BOOL, t.VariableRole.STATE)
OF_POT = Scope({**SCOPE.variables, "pot.water_hot": WATER})


def test_a_variable_of_a_module_is_found_by_its_full_name() -> None:
    assert attribute(name("pot"), "water_hot", OF_POT) == (WATER, BOOL)
    assert declared_type([parse("pot.water_hot")], OF_POT, {}) == BOOL


def test_a_variable_of_a_module_that_may_not_be_read_is_named_whole() -> None:
    with pytest.raises(ExpressionTypeError) as near:
        attribute(name("pot"), "water_ht", OF_POT)
    assert (near.value.message, near.value.cure) == (
        "`pot.water_ht` is not declared here",
        "did you mean `pot.water_hot`? Or let `pot` declare it `public`, if it has it",
    )
    with pytest.raises(ExpressionTypeError) as hidden:
        attribute(name("pot"), "water_hot", SCOPE)
    assert hidden.value.message == "`pot.water_hot` is not declared here"
    assert hidden.value.cure is not None
    assert "`policy.perception.shared`" in hidden.value.cure


def test_a_corner_of_a_volume_is_a_constant_point() -> None:
    (volume, box), *_ = SCOPE.volumes.items()
    for corner, values in (("lower", box.lower), ("upper", box.upper)):
        found = attribute(name(volume), corner, SCOPE)
        assert found is not None
        assert evaluate(found[0], {}) == values
        assert found[1] == VectorType(LENGTH)
    with pytest.raises(ExpressionTypeError) as raised:
        attribute(name(volume), "uppr", SCOPE)
    assert (raised.value.message, raised.value.cure) == ("a volume has no `uppr`", "did you mean `upper`?")
    with pytest.raises(ExpressionTypeError) as raised:
        attribute(name(volume), "centre", SCOPE)
    assert raised.value.cure == "it has the corners `lower` and `upper`"


def test_the_attribute_of_anything_else_is_left_to_the_caller() -> None:
    assert attribute(name("p"), "x", SCOPE) is None
    assert attribute(s.BooleanLiteral(True, EXTENT), "speed") is None


@pytest.mark.parametrize(
    ("base", "text", "message", "cure"),
    [
        ("inputs", "pcae", "there is no input `pcae`", "did you mean `pace`?"),
        ("inputs", "width", "there is no input `width`", "declare it under `inputs`"),
        ("moving", "sped", "the action `moving` has no parameter `sped`", "did you mean `speed`?"),
        ("moving", "width", "the action `moving` has no parameter `width`", None),
    ],
)
def test_an_input_or_parameter_that_is_not_declared_is_refused(
    base: str, text: str, message: str, cure: str | None
) -> None:
    with pytest.raises(ExpressionTypeError) as raised:
        attribute(name(base), text)
    assert (raised.value.message, raised.value.cure, raised.value.extent) == (message, cure, EXTENT)


def test_only_a_whole_number_is_read_as_another_type() -> None:
    assert type(value_type(IntegerType())) is RealType
    assert [value_type(one) for one in (BOOL, SPEED, MODE)] == [BOOL, SPEED, MODE]


def test_the_error_for_a_stranger_lists_the_members_or_suggests_one() -> None:
    assert not_a_member(name("jj2"), JOINT).cure == "did you mean `j2`?"
    far = not_a_member(name("wrist"), JOINT)
    assert (far.code, far.cure) == ("AE202", "Joint is one of `j1`, `j2`, `j3`")


def test_nothing_is_suggested_for_a_name_that_is_near_to_none() -> None:
    assert suggest_names("zzz", ["speed"]) is None


def test_an_integer_is_read_as_a_real() -> None:
    assert SCOPE.variables["laps"].type == IntegerType()
    assert resolve_name(name("laps"), SCOPE, {}, None) == (SCOPE.variables["laps"], RealType(NUMBER))
    assert value_type(SPEED) == SPEED


@pytest.mark.parametrize(
    ("texts", "type_"),
    [(["stop", "grip"], GRIP), (["inputs.pace", "grip"], SPEED), (["stop", "1 + 1"], None), ([], None)],
)
def test_the_first_declared_name_gives_the_type(texts: list[str], type_: object) -> None:
    assert declared_type(map(parse, texts), SCOPE, {}) == type_


def test_a_volume_is_found_by_its_name() -> None:
    assert resolve_volume(name("cell"), SCOPE) == SCOPE.volumes["cell"]
    with pytest.raises(ExpressionTypeError) as raised:
        resolve_volume(name("cel"), SCOPE)
    assert raised.value.cure == "did you mean `cell`?"


def test_a_constant_is_a_value() -> None:
    constant = t.Absolute(t.Literal(Fraction(1), RealType(LENGTH)))
    with pytest.raises(AssertionError, match=r"^not a constant: Absolute"):
        check(parse("odd <= 1 m"), replace(SCOPE, constants={"odd": constant}), BOOL)
