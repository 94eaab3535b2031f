"""Search for the smallest edit of a condition's text that makes it imply another condition.

Either one of its numbers is moved, by as little as possible, or a condition is added.  A bound is a decimal
in the unit the author used.  It is a constant of the other condition if that is the least change, else
it has three more digits than the author wrote.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction

from aeros.spec.backends.oracle import Oracle
from aeros.spec.expr import syntax as s
from aeros.spec.expr import terms as t
from aeros.spec.expr.parser import ExpressionSyntaxError, parse
from aeros.spec.expr.scope import ExpressionTypeError, Scope
from aeros.spec.expr.typecheck.check import check, infer
from aeros.spec.expr.types import BOOL, RealType
from aeros.spec.expr.units import Unit, exact_decimal, to_unit
from aeros.spec.model.variables import Declared
from aeros.spec.verification.queries import is_implied, is_unsatisfiable
from aeros.spec.verification.repairs.condition_text import (
    add_bound,
    branches_of,
    comparisons_in,
    conjoin_texts,
    count_decimals,
    is_conditional,
    read_number,
    replace_number,
    unit_used_for,
)

EXTRA_DIGITS = 3  # digits of a searched bound, beyond those the author wrote
MAX_QUERIES = 300  # for one line; the search for one bound takes some thirty
_FINER = 3  # further digits, to show that a constant of the goal is the least change


@dataclass(frozen=True)
class _Bound:
    """A number of the text, or one to add, that bounds a value.

    Attributes:
        value: the number as it stands, in `unit`; too lax.
        unit: its unit.
        upper: True if it bounds from above.
        distance: a value in `unit` so strict that nothing is left.
        decimals: digits after the point that the author wrote.
        replace_in_text: gives the text with the bound at another value, excluded or not; None if it cannot be
            excluded by itself.
    """

    value: Fraction
    unit: Unit
    upper: bool
    distance: Fraction
    decimals: int
    replace_in_text: Callable[[str, bool], str | None]


class ConditionEditor:
    """Editor of conditions over declared variables; every text it returns is proved to do what is asked.

    One editor asks the solver at most `MAX_QUERIES` times.

    Args:
        scope: meaning of the names in the conditions.
        declared: the variables with their ranges.
        oracle: solver with its budget.
        readable: names of the state variables that an edited text may read.
        bounds_state: True if bounds on state variables may be moved, as in preconditions; False for bounds on
            what a skill chooses.
    """

    def __init__(
        self,
        scope: Scope,
        declared: tuple[Declared, ...],
        oracle: Oracle,
        readable: frozenset[str] = frozenset(),
        *,
        bounds_state: bool = False,
    ) -> None:
        self._readable = readable
        self._bounds_state = bounds_state
        self._scope = scope
        self._declared = declared
        self._oracle = oracle
        self._queries_left = MAX_QUERIES

    def term(self, text: str) -> t.Term | None:
        """Parse and type-check a condition.

        Args:
            text: text of the condition.

        Returns:
            The condition, or None if the text is not one.
        """
        try:
            return check(parse(text), self._scope, BOOL)
        except (ExpressionSyntaxError, ExpressionTypeError):
            return None

    def implies(self, text: str, goal: t.Term) -> bool:
        """Tell whether a condition is proved to imply another.

        Args:
            text: text of the condition.
            goal: the other condition.

        Returns:
            True if it is proved; False also if the queries are used up.
        """
        self._queries_left -= 1
        term = self.term(text) if self._queries_left >= 0 else None
        return term is not None and is_implied(goal, (term,), self._declared, self._oracle)

    def strengthen(self, text: str, goal: t.Term, goal_text: str) -> str | None:
        """Find the least edit of a condition that makes it imply a goal and leaves it satisfiable.

        No edit allows more than the conjunction of both.  So a goal that depends on the state, such as `near
        implies speed <= 1 m/s`, is added as it stands, unless to move a number allows as much.  Where the
        state may not be read, the bound holds in all states.

        Args:
            text: text of the condition.
            goal: the goal.
            goal_text: text of the goal, which may be added as it stands.

        Returns:
            The edited text, or None if no edit is found.
        """
        edited = self._smallest_change(self._literal_bounds(text), goal)
        state = _state_read_by(goal)
        if is_conditional(parse(goal_text)) if state else edited is None:
            is_readable = state <= self._readable and t.variables_of(goal).keys() != state
            together = self._conjoin(text, goal, goal_text) if is_readable else None
            term = None if together is None else self.term(together)
            if edited is None or (term is not None and not self._allows_all(edited, term)):
                edited = together or edited
        return edited or self._smallest_change(self._new_bounds(text, goal, goal_text), goal)

    def loosen(self, text: str, others: Sequence[t.Term]) -> list[str]:
        """Find edits of a condition that move one bound so far that it can hold, and not further.

        Args:
            text: text of a condition that cannot hold together with the others.
            others: the other conditions.

        Returns:
            The edited texts, the one with the smallest relative change first.
        """
        found: list[tuple[Fraction, str]] = []
        for bound in self._literal_bounds(text):
            sign, scale = (1 if bound.upper else -1), 10 ** (bound.decimals + EXTRA_DIGITS)
            strict = int(bound.value * scale * sign)
            lax = strict + int(abs(bound.distance - bound.value) * scale) + 1
            if self._text_that_can_hold(bound, Fraction(lax * sign, scale), others) is None:
                continue
            while lax - strict > 1:
                middle = (lax + strict) // 2
                if self._text_that_can_hold(bound, Fraction(middle * sign, scale), others) is None:
                    strict = middle
                else:
                    lax = middle
            value = Fraction(lax * sign, scale)
            edited = self._text_that_can_hold(bound, value, others)
            if edited is not None:
                change = abs(value - bound.value)
                found.append((change / abs(bound.value) if bound.value else change, edited))
        return [edited for _, edited in sorted(found)]

    def _text_that_can_hold(self, bound: _Bound, value: Fraction, others: Sequence[t.Term]) -> str | None:
        self._queries_left -= 1
        shown = exact_decimal(value)
        text = None if shown is None or self._queries_left < 0 else bound.replace_in_text(shown, False)
        term = None if text is None else self.term(text)
        if term is None or is_unsatisfiable((term, *others), self._declared, self._oracle):
            return None
        return text

    def _conjoin(self, text: str, goal: t.Term, goal_text: str) -> str | None:
        """Return the conjunction with the text of the goal; None if it holds nowhere."""
        return self._if_satisfiable(conjoin_texts(text, goal_text)) if self.term(goal_text) == goal else None

    def _allows_all(self, text: str, wanted: t.Term) -> bool:
        """Tell if it is proved that a text holds wherever a condition does."""
        term = self.term(text)
        return term is not None and is_implied(term, (wanted,), self._declared, self._oracle)

    def _if_satisfiable(self, text: str) -> str | None:
        term = self.term(text)
        empty = term is None or is_unsatisfiable((term,), self._declared, self._oracle)
        return None if empty else text

    def _smallest_change(self, bounds: Iterator[_Bound], goal: t.Term) -> str | None:
        """Return the text that moves one of the bounds by the smallest fraction of its value."""
        changes: list[tuple[Fraction, str]] = []
        for bound in bounds:
            moved = self._move_bound(bound, goal)
            if moved is not None and self._if_satisfiable(moved[1]) is not None:
                change = abs(moved[0] - bound.value)
                changes.append((change / abs(bound.value) if bound.value else change, moved[1]))
        return min(changes, key=lambda one: one[0])[1] if changes else None

    def _move_bound(self, bound: _Bound, goal: t.Term) -> tuple[Fraction, str] | None:
        """Return the laxest value of the bound with which the text implies `goal`, and that text."""
        sign = 1 if bound.upper else -1

        def text_at(value: Fraction, *, excluded: bool = False) -> str | None:
            shown = exact_decimal(value)
            text = None if shown is None else bound.replace_in_text(shown, excluded)
            return text if text is not None and self.implies(text, goal) else None

        finest = Fraction(sign, 10 ** (bound.decimals + EXTRA_DIGITS + _FINER))
        for value in _matching_constants(bound, goal):
            if text_at(value + finest) is not None:
                continue
            for excluded in (False, True):
                text = text_at(value, excluded=excluded)
                if text is not None:
                    return value, text
        scale = 10 ** (bound.decimals + EXTRA_DIGITS)
        lax, strict = int(bound.value * scale * sign), -int(-bound.distance * scale * sign // 1)
        if lax <= strict or text_at(Fraction(strict * sign, scale)) is None:
            return None
        while lax - strict > 1:
            middle = (lax + strict) // 2
            if text_at(Fraction(middle * sign, scale)) is None:
                lax = middle
            else:
                strict = middle
        value = Fraction(strict * sign, scale)
        text = text_at(value)
        return None if text is None else (value, text)

    def _literal_bounds(self, text: str) -> Iterator[_Bound]:
        """Yield the numbers with which `text` compares parameters or inputs, where less is stricter."""
        for left, right, op in comparisons_in(parse(text)):
            if op not in ("<", "<=", ">", ">="):
                continue
            for side, other, upper in ((right, left, op[0] == "<"), (left, right, op[0] == ">")):
                for literal in branches_of(side):
                    number = read_number(literal)
                    width = None if number is None else self._value_span(other, number[1])
                    if number is None or width is None:
                        continue
                    value, unit = number
                    distance = 2 * abs(value) + width
                    # The operator stands for all branches, and only one of them is to change.
                    between = (left.extent.end, right.extent.start) if literal is side else None
                    replace = replace_number(text, literal.extent, between, op)
                    numeral = text[literal.extent.start : literal.extent.end]
                    limit = value - distance if upper else value + distance
                    yield _Bound(value, unit, upper, limit, count_decimals(numeral), replace)

    def _value_span(self, node: s.Node, unit: Unit) -> Fraction | None:
        """Return the width of the range of an expression, in `unit`; None if it is not to be bounded."""
        try:
            variables = t.variables_of(infer(node, self._scope)[0])
        except ExpressionTypeError:
            return None
        widths = [
            (one.range[1] - one.range[0]) / unit.factor
            for one in self._declared
            if one.name in variables and one.range is not None and self._can_be_bounded(one)
        ]
        return max(widths, default=None)

    def _can_be_bounded(self, variable: Declared) -> bool:
        is_chosen = variable.variable.role is not t.VariableRole.STATE
        return (is_chosen or self._bounds_state) and isinstance(variable.variable.type, RealType)

    def _new_bounds(self, text: str, goal: t.Term, goal_text: str) -> Iterator[_Bound]:
        """Yield bounds to add, on each number that `goal` mentions, as lax as its declared range."""
        mentioned = t.variables_of(goal)
        for one in self._declared:
            if one.range is None or one.name not in mentioned or not self._can_be_bounded(one):
                continue
            unit = unit_used_for(one, text, goal_text)
            low, high = (to_unit(bound, unit) for bound in one.range)
            name = one.name
            for upper in (True, False):
                lax, limit = (high, low) if upper else (low, high)
                yield _Bound(lax, unit, upper, limit, 0, add_bound(text, name, upper, unit))


def _state_read_by(term: t.Term) -> set[str]:
    return {name for name, one in t.variables_of(term).items() if one.role is t.VariableRole.STATE}


def _matching_constants(bound: _Bound, goal: t.Term) -> list[Fraction]:
    """Return the constants of `goal` that could be the bound, the nearest first."""
    constants = {bound.value}
    for value in t.constants_in([goal]):
        constants |= {to_unit(value, bound.unit), to_unit(-value, bound.unit)}
    sign = 1 if bound.upper else -1
    return sorted((one for one in constants if one * sign <= bound.value * sign), key=lambda one: -one * sign)
