"""Gate boundaries: the condition under which the gate allows an action that an envelope does not prove safe.

The text is the rule, simplified under the envelope.  The parts that the envelope decides are left out,
premises become alternatives, and named constants become their values.  The text is shown only if it is proved
equivalent to the rule under the envelope; else the rule's own text is shown, which is always right.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import cast

from aeros.spec.backends.oracle import Oracle
from aeros.spec.elaborate.scopes import scope_over
from aeros.spec.expr import terms as t
from aeros.spec.expr.parser import ExpressionSyntaxError, parse
from aeros.spec.expr.scope import ExpressionTypeError
from aeros.spec.expr.semantics import evaluate
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.types import BOOL, EnumType, RealType
from aeros.spec.expr.units import exact_decimal
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from aeros.spec.obligations.obligation import Obligation
from aeros.spec.verification.queries import is_implied, is_unsatisfiable


def gate_boundary_for(obligation: Obligation, site: Site, oracle: Oracle) -> str:
    """Describe the condition under which the gate allows an action of the envelope, as far as one rule goes.

    Args:
        obligation: the claim that an envelope obeys the rule.
        site: the site that declares the rule.
        oracle: solver with its budget.

    Returns:
        Text of the condition in the expression language.
    """
    rule_text = next(
        (" ".join(rule.text.split()) for rule in site.rules if rule.id == obligation.runtime_checked_rule), ""
    )
    declared, rule = obligation.space.variables, obligation.conclusion
    envelope = relevant_envelope(obligation)
    simplified = _simplify_under(_negation_normal_form(rule, is_true=True), envelope, declared, oracle)
    text = _format_term(simplified, {one.name: one for one in declared})
    if text is None:
        return rule_text
    try:
        parsed = check(parse(text), scope_over(site, declared), BOOL)
    except (ExpressionSyntaxError, ExpressionTypeError):
        return rule_text
    if parsed == rule:
        return text
    differ = t.Or((t.And((parsed, t.Not(rule))), t.And((rule, t.Not(parsed)))))
    return text if is_unsatisfiable((*envelope, differ), declared, oracle) else rule_text


def relevant_envelope(obligation: Obligation) -> tuple[t.Term, ...]:
    """Select an obligation's assumptions if they share a variable with its conclusion.

    Args:
        obligation: the claim that an envelope obeys a rule.

    Returns:
        The assumptions, or none.
    """
    return _if_relevant(t.variables_of(obligation.conclusion), obligation.space.assumptions)


def _if_relevant(names: Mapping[str, t.Variable], assumptions: tuple[t.Term, ...]) -> tuple[t.Term, ...]:
    """Return the assumptions if they mention any of `names`; otherwise they cannot help."""
    is_relevant = any(names.keys() & t.variables_of(one).keys() for one in assumptions)
    return assumptions if is_relevant else ()


def _negation_normal_form(term: t.Term, *, is_true: bool) -> t.Term:
    """Rewrite `term`, or its negation, as conjunctions and disjunctions of comparisons and other atoms."""
    match term:
        case t.Not(operand=operand):
            return _negation_normal_form(operand, is_true=not is_true)
        case t.Implies(premise=premise, conclusion=conclusion):
            both = (
                _negation_normal_form(premise, is_true=not is_true),
                _negation_normal_form(conclusion, is_true=is_true),
            )
            return t.Or(both) if is_true else t.And(both)
        case t.And(operands=operands) | t.Or(operands=operands):
            parts = tuple(_negation_normal_form(operand, is_true=is_true) for operand in operands)
            return t.And(parts) if isinstance(term, t.And) is is_true else t.Or(parts)
        case t.Compare(op="<", left=left, right=right) if not is_true:
            return t.Compare("<=", right, left)
        case t.Compare(op="<=", left=left, right=right) if not is_true:
            return t.Compare("<", right, left)
        case _:
            return term if is_true else t.Not(term)


def _simplify_under(
    term: t.Term, envelope: tuple[t.Term, ...], declared: tuple[Declared, ...], oracle: Oracle
) -> t.Term:
    """Remove the parts of `term` that the envelope decides."""
    if not isinstance(term, t.And | t.Or):
        about = _if_relevant(t.variables_of(term), envelope)
        if about and is_implied(term, about, declared, oracle):
            return t.TRUE
        return t.FALSE if about and is_unsatisfiable((*about, term), declared, oracle) else term
    parts = [_simplify_under(operand, envelope, declared, oracle) for operand in term.operands]
    neutral, absorbing = (t.TRUE, t.FALSE) if isinstance(term, t.And) else (t.FALSE, t.TRUE)
    if absorbing in parts:
        return absorbing
    kept: list[t.Term] = []
    for part in parts:
        inner = part.operands if isinstance(part, t.And | t.Or) and type(part) is type(term) else (part,)
        kept += [one for one in inner if one != neutral and one not in kept]
    return kept[0] if len(kept) == 1 else type(term)(tuple(kept)) if kept else neutral


def _format_term(term: t.Term, declared: Mapping[str, Declared]) -> str | None:
    """Write `term` in the expression language; None for kinds of terms that the rule itself says better."""
    match term:
        case t.Variable(name=name, type=type_) if type_ == BOOL:
            return name
        case t.Not(operand=t.Compare(op="==") as operand):
            return _format_comparison("!=", operand.left, operand.right, declared)
        case t.Not(operand=t.Variable() as operand):
            return f"not {operand.name}"
        case t.And(operands=operands) | t.Or(operands=operands) if operands:
            word, parts = " and " if isinstance(term, t.And) else " or ", []
            for part in operands:
                shown = _format_term(part, declared)
                if shown is None:
                    return None
                parts.append(f"({shown})" if isinstance(part, t.And | t.Or) else shown)
            return word.join(parts)
        case t.Compare(op=op, left=left, right=right):
            return _format_comparison(op, left, right, declared) or _solve_for_variable(term, declared)
        case _:
            return None


_MIRRORED_OPS = {"<": ">", "<=": ">=", "==": "==", "!=": "!="}


def _format_comparison(op: str, left: t.Term, right: t.Term, declared: Mapping[str, Declared]) -> str | None:
    """Write a comparison of a quantity with a constant, the quantity first, in its declared unit."""
    if isinstance(left, t.Literal):
        op, left, right = _MIRRORED_OPS[op], right, left
    match left:
        case t.Variable(name=name, type=RealType() | EnumType()):
            shown = name
        case t.Absolute(operand=t.Variable(name=name)):
            shown = f"abs({name})"
        case t.Component(vector=t.Variable(name=name), axis=axis):
            shown = f"{name}.{'xyz'[axis]}"
        case t.Select(family=t.Variable(name=name), index=t.Literal(value=member)):
            shown = f"{name}[{member}]"
        case _:
            return None
    constant = _constant(right, declared[name])
    return None if constant is None else f"{shown} {op} {constant}"


def _constant(term: t.Term, quantity: Declared) -> str | None:
    if not isinstance(term, t.Literal) or isinstance(term.value, bool):
        return None
    if isinstance(term.value, str):
        return term.value
    number = exact_decimal(term.value / quantity.unit.factor)
    return number if number is None or quantity.unit.text == "1" else f"{number} {quantity.unit.text}"


def _solve_for_variable(term: t.Compare, declared: Mapping[str, Declared]) -> str | None:
    """Write a comparison that is linear in its only variable, solved for that variable."""
    variables = list(t.variables_of(term).values())
    if len(variables) != 1 or not isinstance(variables[0].type, RealType) or term.op == "==":
        return None
    (variable,) = variables

    def excess(at: int) -> Fraction:
        values = {variable.name: Fraction(at)}
        return cast("Fraction", evaluate(term.left, values)) - cast("Fraction", evaluate(term.right, values))

    start, slope = excess(0), excess(1) - excess(0)
    if slope == 0 or excess(2) - excess(1) != slope:
        return None
    bound = t.Literal(-start / slope, cast("RealType", variable.type))
    left, right = (variable, bound) if slope > 0 else (bound, variable)
    return _format_comparison(term.op, left, right, declared)
