"""The scope of an expression and the error for one that does not fit it."""

from __future__ import annotations

from aeros.spec.expr.scope import ExpressionTypeError, Scope
from aeros.spec.expr.syntax import TextRange


def test_a_scope_has_nothing_but_what_is_given() -> None:
    scope = Scope({})
    assert [scope.inputs, scope.constants, scope.enums, scope.volumes, scope.roles] == [{}] * 5
    assert not scope.past


def test_an_error_says_what_where_and_what_to_do() -> None:
    related = TextRange(5, 6), "m"
    error = ExpressionTypeError(
        "AE203", "units differ", TextRange(0, 1), label="s", related=related, cure="divide"
    )
    assert str(error) == error.message == "units differ"
    assert (error.code, error.extent, error.label) == ("AE203", TextRange(0, 1), "s")
    assert (error.related, error.cure) == (related, "divide")


def test_an_error_need_not_know_more_than_the_place() -> None:
    error = ExpressionTypeError("AE203", "units differ", TextRange(0, 1))
    assert (error.label, error.related, error.cure) == ("", None, None)
