"""Gate boundaries: the condition under which the gate allows an action that an envelope does not prove safe.

The text is the rule, simplified under the envelope.  The parts that the envelope decides are left out,
premises become alternatives, and named constants become their values.  The text is shown only if it is proved
equivalent to the rule under the envelope; else the rule's own text is shown, which is always right.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
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
from aeros.spec.expr.units import exact_decimal, to_unit
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from aeros.spec.obligations.obligation import Obligation
from aeros.spec.verification.queries import are_unsatisfiable


def gate_boundaries(obligations: Sequence[Obligation], site: Site, oracle: Oracle) -> list[str]:
    """Describe conditions under which the gate allows actions of an envelope, as far as one rule goes.

    Args:
        obligations: claims that an envelope obeys a rule.
        site: the site that declares the rules.
        oracle: solver with its budget.

    Returns:
        For each claim the text of the condition in the expression language.
    """
    drafts = [_Draft(one, site) for one in obligations]
    leaves = [(terms, draft.declared) for draft in drafts for terms in draft.leaf_questions()]
    decided = iter(are_unsatisfiable(leaves, oracle))
    for draft in drafts:
        draft.simplify(decided)
    open_ = [draft for draft in drafts if draft.difference]
    same = are_unsatisfiable([(draft.difference, draft.declared) for draft in open_], oracle)
    for draft, is_same in zip(open_, same, strict=True):
        draft.is_shown = is_same
    return [draft.text if draft.is_shown else draft.rule_text for draft in drafts]


class _Draft:
    """Text of one boundary in the making.

    Attributes:
        declared: every variable of the claim.
        rule_text: text of the rule.
        text: text of the rule as it is under the envelope.
        difference: conditions that hold where the two differ; none if they are the same or not compared.
        is_shown: True if `text` is to be shown, and not `rule_text`.
    """

    def __init__(self, obligation: Obligation, site: Site) -> None:
        self.declared = obligation.space.variables
        self.rule_text = next(
            (
                " ".join(rule.text.split())
                for rule in site.rules
                if rule.id == obligation.runtime_checked_rule
            ),
            "",
        )
        self.text = ""
        self.difference: tuple[t.Term, ...] = ()
        self.is_shown = False
        self._site = site
        self._rule = obligation.conclusion
        self._envelope = relevant_envelope(obligation)
        self._alternatives = _negation_normal_form(self._rule, is_true=True)

    def leaf_questions(self) -> Iterator[tuple[t.Term, ...]]:
        """Yield two questions on each part of the rule about which the envelope may say something."""
        for leaf, about in self._leaves(self._alternatives):
            if about:
                yield (*about, t.Not(leaf))
                yield (*about, leaf)

    def simplify(self, decided: Iterator[bool]) -> None:
        """Leave out what the envelope decides.

        Args:
            decided: for each of `leaf_questions` in order, whether the conditions cannot hold together.
        """
        simplified = self._simplified(self._alternatives, decided)
        text = _format_term(simplified, {one.name: one for one in self.declared})
        if text is None:
            return
        try:
            parsed = check(parse(text), scope_over(self._site, self.declared), BOOL)
        except (ExpressionSyntaxError, ExpressionTypeError):
            return
        self.text, self.is_shown = text, parsed == self._rule
        if not self.is_shown:
            rule = self._rule
            differ = t.Or((t.And((parsed, t.Not(rule))), t.And((rule, t.Not(parsed)))))
            self.difference = (*self._envelope, differ)

    def _leaves(self, term: t.Term) -> Iterator[tuple[t.Term, tuple[t.Term, ...]]]:
        if isinstance(term, t.And | t.Or):
            for operand in term.operands:
                yield from self._leaves(operand)
        else:
            yield term, _if_relevant(t.variables_of(term), self._envelope)

    def _simplified(self, term: t.Term, decided: Iterator[bool]) -> t.Term:
        if not isinstance(term, t.And | t.Or):
            if not _if_relevant(t.variables_of(term), self._envelope):
                return term
            is_implied, is_impossible = next(decided), next(decided)
            return t.TRUE if is_implied else t.FALSE if is_impossible else term
        parts = [self._simplified(operand, decided) for operand in term.operands]
        neutral, absorbing = (t.TRUE, t.FALSE) if isinstance(term, t.And) else (t.FALSE, t.TRUE)
        if absorbing in parts:
            return absorbing
        kept: list[t.Term] = []
        for part in parts:
            inner = part.operands if isinstance(part, t.And | t.Or) and type(part) is type(term) else (part,)
            kept += [one for one in inner if one != neutral and one not in kept]
        return kept[0] if len(kept) == 1 else type(term)(tuple(kept)) if kept else neutral


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
    number = exact_decimal(to_unit(term.value, quantity.unit))
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
