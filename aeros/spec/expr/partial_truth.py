"""Three-valued truth of a condition of which some variables are unknown (Kleene's strong logic).

A condition is true (false) if it is so whatever the unknown variables are, as far as `not`, `and`, `or`,
`implies`, `if` and quantifiers show that. The answer may be unknown although all values lead to one truth, as
in `a or not a`; it is never wrong.
"""

from __future__ import annotations

from collections.abc import Iterable

from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import Environment, is_true


def partial_truth(term: t.Term, known: Environment) -> bool | None:
    """Evaluate a condition as far as the known values decide it.

    Args:
        term: well-typed boolean term without past-time operators.
        known: exact values of some of its free variables, and of each enclosing quantifier's index, by name.

    Returns:
        Truth value that the term has for all values of the other variables; None if it is unknown.
    """
    if t.variables_of(term).keys() <= known.keys():
        return is_true(term, known)
    match term:
        case t.Not(operand=operand):
            return _negation(partial_truth(operand, known))
        case t.And(operands=operands):
            return _conjunction(partial_truth(operand, known) for operand in operands)
        case t.Or(operands=operands):
            return _disjunction(partial_truth(operand, known) for operand in operands)
        case t.Implies(premise=premise, conclusion=conclusion):
            return _disjunction((_negation(partial_truth(premise, known)), partial_truth(conclusion, known)))
        case t.Conditional(condition=condition, then=then, otherwise=otherwise):
            return _choice(
                partial_truth(condition, known), partial_truth(then, known), partial_truth(otherwise, known)
            )
        case t.Quantified(kind=kind, index=index, body=body):
            each = (partial_truth(body, {**known, index.name: member}) for member in index.type.members)
            return _conjunction(each) if kind == "all" else _disjunction(each)
    return None


def _negation(truth: bool | None) -> bool | None:
    return None if truth is None else not truth


def _disjunction(truths: Iterable[bool | None]) -> bool | None:
    found = list(truths)
    return True if True in found else None if None in found else False


def _conjunction(truths: Iterable[bool | None]) -> bool | None:
    return _negation(_disjunction(map(_negation, truths)))


def _choice(condition: bool | None, then: bool | None, otherwise: bool | None) -> bool | None:
    if condition is None:
        return then if then is otherwise else None
    return then if condition else otherwise
