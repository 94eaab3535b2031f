"""Resolution of names: indices, variables, constants, members, inputs, parameters and volumes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

from aeros.spec.diagnostics.codes import did_you_mean
from aeros.spec.expr import syntax as s
from aeros.spec.expr import terms as t
from aeros.spec.expr.scope import AxisAlignedBox, ExpressionTypeError, Scope
from aeros.spec.expr.types import BOOL, EnumType, IntegerType, RealType, Type, VectorType
from aeros.spec.expr.units import LENGTH, NUMBER

_MAX_SLIP: Final = 2
"""Characters by which the lengths of a name and of its misspelling differ at most."""

Bound = Mapping[str, t.BoundVariable]
"""Indices of the enclosing quantifiers, by name."""


def resolve_name(node: s.Name, scope: Scope, bound: Bound, hint: Type | None) -> tuple[t.Term, Type]:
    """Resolve a name that stands alone.

    Args:
        node: the name.
        scope: declared names.
        bound: indices of the enclosing quantifiers, by name.
        hint: type that the context expects; it chooses the enum of a bare member.

    Returns:
        The term and its type.

    Raises:
        ExpressionTypeError: the name is not declared, or is a member of several enums and no hint decides.
    """
    text = node.text
    if text in bound:
        return bound[text], bound[text].type
    if text in scope.variables:
        return scope.variables[text], value_type(scope.variables[text].type)
    if text in scope.constants:
        return scope.constants[text], _type_of_constant(scope.constants[text])
    if text in scope.definitions:
        return _definition(node, scope), BOOL
    candidates = [enum for enum in scope.enums.values() if text in enum.members]
    if isinstance(hint, EnumType) and text in hint.members:
        return t.Literal(text, hint), hint
    if len(candidates) == 1 and not isinstance(hint, EnumType):
        return t.Literal(text, candidates[0]), candidates[0]
    if isinstance(hint, EnumType):
        raise not_a_member(node, hint)
    if candidates:
        several = " and of ".join(str(enum) for enum in candidates)
        raise ExpressionTypeError(
            "AE202",
            f"`{text}` is a member of {several}",
            node.extent,
            cure="compare it with a variable, which decides the enum: `variable == member`",
        )
    _check_is_no_memory(node, text, scope)
    members = (member for enum in scope.enums.values() for member in enum.members)
    known = [*bound, *scope.variables, *scope.constants, *scope.definitions, *members]
    raise ExpressionTypeError(
        "AE202", f"`{text}` is not declared here", node.extent, cure=_cure_for_unknown(text, known, scope)
    )


def _cure_for_unknown(name: str, known: Iterable[str], scope: Scope) -> str:
    """Say what to write for an unknown name: the name that it misspells, or a parameter of the action."""
    parameters = [each for each, one in scope.variables.items() if one.role is t.VariableRole.PARAMETER]
    near = did_you_mean(name, parameters) or did_you_mean(name, known)
    is_misspelt = near is not None and abs(len(near) - len(name)) <= _MAX_SLIP
    if near is not None and (is_misspelt or near in parameters or not parameters):
        return f"did you mean `{near}`?"
    listed = f" ({', '.join(f'`{one}`' for one in parameters)})" if parameters else ""
    if near is not None:
        return f"use a parameter of the action{listed}; or did you mean `{near}`?"
    otherwise = f"use a parameter of the action{listed or ' kind'}"
    return f"declare it at the site or in the module's `needs`, or {otherwise}"


def resolve_attribute(node: s.Attribute, scope: Scope, bound: Bound) -> tuple[t.Term, Type] | None:
    """Resolve `inputs.NAME`, `ROLE.PARAMETER`, `MODULE.VARIABLE`, `VOLUME.lower` or `VOLUME.upper`.

    Args:
        node: the attribute expression.
        scope: declared inputs, roles, variables and volumes.
        bound: indices of the enclosing quantifiers, by name.

    Returns:
        The variable or corner and its type; None if the base is a name that stands alone, or no name.

    Raises:
        ExpressionTypeError: the input, parameter, variable or corner is not declared.
    """
    if not isinstance(node.base, s.Name):
        return None
    base, text = node.base.text, node.name.text
    variable = scope.variables.get(f"{base}.{text}")
    if variable is not None:
        return variable, value_type(variable.type)
    _check_is_no_memory(node, f"{base}.{text}", scope)
    if base == "inputs":
        among, fault = scope.inputs, f"there is no input `{text}`"
        otherwise: str | None = "declare it under `inputs`"
    elif base in scope.roles:
        among, fault = scope.roles[base], f"the action `{base}` has no parameter `{text}`"
        otherwise = None
    elif base in scope.volumes and base not in bound:
        return _corner(node, scope.volumes[base], text)
    else:
        _check_base_is_known(node, base, text, scope, bound)
        return None
    if text not in among:
        raise ExpressionTypeError("AE202", fault, node.extent, cure=suggest_names(text, among) or otherwise)
    return among[text], value_type(among[text].type)


def _definition(node: s.Name, scope: Scope) -> t.Term:
    """Return the condition that a name stands for.

    Raises:
        ExpressionTypeError: it reads a state variable that may not be read here.
    """
    term = scope.definitions[node.text]
    readable = {one.name for one in scope.variables.values()}
    hidden = [name for name in t.variables_of(term) if name not in readable]
    if hidden:
        raise ExpressionTypeError(
            "AE202",
            f"`{node.text}` reads `{hidden[0]}`, which cannot be read here",
            node.extent,
            cure="a module can read another's variable that the site shares, if it requires that module; "
            "an invariant can if the entry there has `in_invariants: true`",
        )
    return term


def _corner(node: s.Attribute, volume: AxisAlignedBox, text: str) -> tuple[t.Term, Type]:
    """Return a corner of a volume: a point in W, m.

    Raises:
        ExpressionTypeError: a volume has no such attribute.
    """
    corners = {"lower": volume.lower, "upper": volume.upper}
    if text not in corners:
        cure = suggest_names(text, corners) or "it has the corners `lower` and `upper`"
        raise ExpressionTypeError("AE202", f"a volume has no `{text}`", node.extent, cure=cure)
    x, y, z = (t.Literal(value, RealType(LENGTH)) for value in corners[text])
    return t.Vector(x, y, z), VectorType(LENGTH)


def _check_is_no_memory(node: s.Name | s.Attribute, name: str, scope: Scope) -> None:
    """Report a name that is declared, and that a perceiver gives out of memory.

    Raises:
        ExpressionTypeError: it is one.
    """
    if name in scope.recalled:
        raise ExpressionTypeError(
            "AE202",
            f"`{name}` comes from memory, so no condition may read it",
            node.extent,
            cure="read a variable of a perceiver without `memory` under its `readings`; "
            "skill code may read this one",
        )


def _check_base_is_known(node: s.Attribute, base: str, text: str, scope: Scope, bound: Bound) -> None:
    """Report `BASE.TEXT` as a variable of a module if nothing has a name like `BASE`.

    Raises:
        ExpressionTypeError: no such variable may be read here.
    """
    alone = [*bound, *scope.variables, *scope.constants, *scope.definitions]
    if base in alone or any(base in enum.members for enum in scope.enums.values()):
        return
    cure = suggest_names(f"{base}.{text}", [name for name in scope.variables if "." in name])
    if cure is None and did_you_mean(base, alone) is not None:
        return
    raise ExpressionTypeError(
        "AE202",
        f"`{base}.{text}` is not declared here",
        node.extent,
        cure=f"{cure} Or let `{base}` declare it `public`, if it has it"
        if cure is not None and any(name.startswith(f"{base}.") for name in scope.variables)
        else cure
        or "another module's variable can be read if that module declares it `public`, or the site shares it "
        "under `policy.perception.shared`, and this module requires the other",
    )


def resolve_volume(name: s.Name, scope: Scope) -> AxisAlignedBox:
    """Resolve the name of a volume.

    Args:
        name: the name.
        scope: declared volumes.

    Returns:
        The box.

    Raises:
        ExpressionTypeError: there is no such volume.
    """
    box = scope.volumes.get(name.text)
    if box is None:
        cure = suggest_names(name.text, scope.volumes) or (
            "declare it under the site's `volumes`, or under `needs` of the module: "
            f"`{name.text}: {{is: volume}}`"
        )
        raise ExpressionTypeError(
            "AE202", f"`{name.text}` is not a volume of this site", name.extent, cure=cure
        )
    return box


def declared_type(operands: Iterable[s.Node], scope: Scope, bound: Bound) -> Type | None:
    """Return the type of the first operand that is a declared name, to choose a leading member's enum.

    Args:
        operands: operands of a comparison chain after the first.
        scope: declared names.
        bound: indices of the enclosing quantifiers, by name.

    Returns:
        Its declared type; None if no operand is a declared name.
    """
    for operand in operands:
        match operand:
            case s.Name(text=name) if name in bound:
                return bound[name].type
            case s.Name(text=name) if name in scope.variables:
                return scope.variables[name].type
            case s.Attribute(base=s.Name(text="inputs"), name=s.Name(text=name)) if name in scope.inputs:
                return scope.inputs[name].type
            case s.Attribute(base=s.Name(text=base), name=s.Name(text=name)) if (
                f"{base}.{name}" in scope.variables
            ):
                return scope.variables[f"{base}.{name}"].type
    return None


def value_type(type_: Type) -> Type:
    """Return the type that a variable is read as.

    Args:
        type_: declared type.

    Returns:
        A dimensionless real for an integer; otherwise `type_`.
    """
    return RealType(NUMBER) if isinstance(type_, IntegerType) else type_


def not_a_member(name: s.Name, enum: EnumType) -> ExpressionTypeError:
    """Build the error for a name that is no member of an enum.

    Args:
        name: the name, with its place.
        enum: the enum that was expected.

    Returns:
        The error, which lists the members or suggests the nearest one.
    """
    members = ", ".join(f"`{member}`" for member in enum.members)
    cure = suggest_names(name.text, enum.members) or f"{enum} is one of {members}"
    return ExpressionTypeError("AE202", f"`{name.text}` is not a member of {enum}", name.extent, cure=cure)


def suggest_names(name: str, candidates: Iterable[str]) -> str | None:
    """Suggest a similar name.

    Args:
        name: unknown name.
        candidates: names that are declared.

    Returns:
        A help text that proposes the nearest candidate; None if none is near.
    """
    candidate = did_you_mean(name, candidates)
    return None if candidate is None else f"did you mean `{candidate}`?"


def _type_of_constant(constant: t.Term) -> Type:
    match constant:
        case t.Literal(type=type_) | t.ConstantTable(type=type_):
            return type_
        case t.Vector(x=t.Literal(type=RealType(dimension=dimension))):
            return VectorType(dimension)
    raise AssertionError(f"not a constant: {constant}")
