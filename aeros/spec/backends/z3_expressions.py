"""Expressions of Z3, made by its C interface: operators of its Python interface take four times as long.

They look for the sorts of both sides and convert one into the other. Terms have types, so there is no need.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any, Final

import z3

_COMPARISONS: Final = {"<": z3.Z3_mk_lt, "<=": z3.Z3_mk_le, "==": z3.Z3_mk_eq}


class Expressions:
    """Maker of expressions in one context.

    Args:
        context: context of Z3.
    """

    def __init__(self, context: Any) -> None:
        self._context = context
        self._ref = context.ref()
        self._numbers: dict[tuple[int, int], Any] = {}

    def number(self, value: Fraction) -> Any:
        """Make a number, once for each value.

        Args:
            value: the number.

        Returns:
            The expression.
        """
        key = value.numerator, value.denominator  # hashing a fraction takes longer than making a number
        if key not in self._numbers:
            self._numbers[key] = self.new_number(value)
        return self._numbers[key]

    def new_number(self, value: Fraction) -> Any:
        """Make a number that is not kept.

        Args:
            value: the number.

        Returns:
            The expression.
        """
        return z3.RealVal(f"{value.numerator}/{value.denominator}", self._context)

    def truth(self, value: bool) -> Any:
        """Make a truth value.

        Args:
            value: the truth value.

        Returns:
            The expression.
        """
        make = z3.Z3_mk_true if value else z3.Z3_mk_false
        return z3.BoolRef(make(self._ref), self._context)

    def negation(self, one: Any) -> Any:
        """Make the negation of a Boolean.

        Args:
            one: the Boolean.

        Returns:
            The expression.
        """
        return z3.BoolRef(z3.Z3_mk_not(self._ref, one.ast), self._context)

    def conjunction(self, parts: Sequence[Any]) -> Any:
        """Make a conjunction.

        Args:
            parts: Booleans; none are true.

        Returns:
            The expression.
        """
        return z3.BoolRef(z3.Z3_mk_and(self._ref, len(parts), _array(parts)), self._context)

    def disjunction(self, parts: Sequence[Any]) -> Any:
        """Make a disjunction.

        Args:
            parts: Booleans; none are false.

        Returns:
            The expression.
        """
        return z3.BoolRef(z3.Z3_mk_or(self._ref, len(parts), _array(parts)), self._context)

    def comparison(self, op: str, left: Any, right: Any) -> Any:
        """Compare two expressions of one sort.

        Args:
            op: `<`, `<=` or `==`.
            left: left side.
            right: right side.

        Returns:
            The Boolean.
        """
        return z3.BoolRef(_COMPARISONS[op](self._ref, left.ast, right.ast), self._context)

    def sum(self, left: Any, right: Any) -> Any:
        """Add two numbers.

        Args:
            left: the first.
            right: the second.

        Returns:
            The number.
        """
        return z3.ArithRef(z3.Z3_mk_add(self._ref, 2, _array((left, right))), self._context)

    def product(self, left: Any, right: Any) -> Any:
        """Multiply two numbers.

        Args:
            left: the first.
            right: the second.

        Returns:
            The number.
        """
        return z3.ArithRef(z3.Z3_mk_mul(self._ref, 2, _array((left, right))), self._context)

    def opposite(self, one: Any) -> Any:
        """Negate a number.

        Args:
            one: the number.

        Returns:
            The number.
        """
        return z3.ArithRef(z3.Z3_mk_unary_minus(self._ref, one.ast), self._context)

    def choice(self, condition: Any, then: Any, otherwise: Any) -> Any:
        """Choose between two expressions of one sort.

        Args:
            condition: a Boolean.
            then: the expression where it holds.
            otherwise: the expression elsewhere.

        Returns:
            The expression.
        """
        return type(then)(z3.Z3_mk_ite(self._ref, condition.ast, then.ast, otherwise.ast), self._context)

    def is_true_in(self, model: Any, constant: Any) -> bool:
        """Tell whether a Boolean constant is true in a model.

        Args:
            model: the model.
            constant: the constant.

        Returns:
            False also if the model leaves it open.
        """
        value = z3.Z3_model_get_const_interp(self._ref, model.model, constant.decl().ast)
        return bool(value) and z3.Z3_get_bool_value(self._ref, value) == z3.Z3_L_TRUE


def _array(parts: Sequence[Any]) -> Any:
    return (z3.Ast * len(parts))(*(part.ast for part in parts))
