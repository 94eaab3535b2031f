"""Histories of a site's past-time conditions: state variables that the runtime keeps up to date.

Later stages see only conditions on one state.  In a proof, a history may have any value that its facts
allow, so a proved claim holds whatever happened before.  A refutation may need a past that the rest of the
world rules out.  It then refuses a module that is safe, but an unsafe module is never accepted.
"""

from __future__ import annotations

from dataclasses import fields, replace
from fractions import Fraction
from functools import reduce
from typing import Any, Final

from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, IntegerType, RealType
from aeros.spec.expr.units import NUMBER
from aeros.spec.expr.unparse import unparse
from aeros.spec.model.variables import Declared, History

MAX_OCCURRENCE_COUNT: Final = 4096
"""Upper end of the range of a count of occurrences in one window."""

_ONE, _ZERO = (t.Literal(Fraction(number), RealType(NUMBER)) for number in (1, 0))


class HistoryCollector:
    """Collector of the histories of a site's rules; equal past-time conditions share one history."""

    def __init__(self) -> None:
        self._kept: dict[str, History] = {}

    @property
    def collected(self) -> tuple[History, ...]:
        """The histories collected so far; each comes after those that it depends on."""
        return tuple(self._kept.values())

    def replace_past_terms(self, term: t.Term, span: SourceSpan) -> t.Term:
        """Replace each past-time condition in a term by the variable of its history.

        A quantifier over past-time conditions is expanded first: each member of its index has a history.

        Args:
            term: term of a rule.
            span: position of the rule in its file, for new histories.

        Returns:
            The term without past-time conditions; `term` itself where it has none.
        """
        if not _has_past_term(term):
            return term
        if isinstance(term, t.Quantified | t.Aggregate):
            return self.replace_past_terms(_expand_index(term), span)
        name = unparse(term)  # no other term has the text of a past-time condition
        if name in self._kept:
            return self._kept[name].declared.variable
        changed: dict[str, Any] = {}
        for field in fields(term):
            value = getattr(term, field.name)
            if isinstance(value, t.Term):
                changed[field.name] = self.replace_past_terms(value, span)
            elif isinstance(value, tuple) and value and isinstance(value[0], t.Term):
                changed[field.name] = tuple(self.replace_past_terms(part, span) for part in value)
        inner = replace(term, **changed)
        if not isinstance(inner, t.PastTerm):
            return inner
        self._kept[name] = History(_history_variable(name, inner, span), inner)
        return self._kept[name].declared.variable


def _has_past_term(term: t.Term) -> bool:
    return isinstance(term, t.PastTerm) or any(map(_has_past_term, t.children(term)))


def _expand_index(term: t.Quantified | t.Aggregate) -> t.Term:
    """Expand a quantifier or aggregate over its index: each member has a history of its own."""
    index = term.index
    each = tuple(
        t.substitute(term.body, {index.name: t.Literal(member, index.type)}) for member in index.type.members
    )
    match term.kind:
        case "all":
            return t.And(each)
        case "any":
            return t.Or(each)
        case "count":
            each = tuple(t.Conditional(part, _ONE, _ZERO) for part in each)
    return reduce(t.Add, each)


def _history_variable(name: str, term: t.PastTerm, span: SourceSpan) -> Declared:
    """Declare the variable of a history, with the facts that hold of it in every state."""
    now = Fraction(0)  # seconds: a history is as old as the state it was updated with
    match term:
        case t.Previously():
            return Declared(t.Variable(name, BOOL, t.VariableRole.STATE), span, max_age=now)
        case t.Since(sustained=kept, trigger=reset):
            held = t.Variable(name, BOOL, t.VariableRole.STATE)
            from_reset, kept_up = t.Implies(reset, held), t.Implies(held, t.Or((reset, kept)))
            return Declared(held, span, max_age=now, known_facts=(from_reset, kept_up))
        case t.Occurrences(operand=operand):
            count = t.Variable(name, IntegerType(), t.VariableRole.STATE)
            most = (Fraction(0), Fraction(MAX_OCCURRENCE_COUNT))
            counted = t.Implies(operand, t.Compare("<=", _ONE, count))
            return Declared(count, span, range=most, max_age=now, known_facts=(counted,))
