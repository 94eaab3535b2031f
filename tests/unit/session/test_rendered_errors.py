"""Errors in a user's files with their full text."""

from __future__ import annotations

import pytest

from aeros.session.rendered_errors import rendered_errors
from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel
from aeros.spec.diagnostics.errors import UndecidedError, UserError
from aeros.spec.diagnostics.source import Source


def test_a_user_error_gets_its_full_text_and_stays_what_it_is() -> None:
    fault = Diagnostic("AE130", "`x` is no module", help=("give a folder",))
    with pytest.raises(UndecidedError) as raised, rendered_errors():
        raise UndecidedError([fault])
    assert str(raised.value) == "error[AE130] no-module: `x` is no module\nhelp: give a folder\n"
    assert raised.value.diagnostics == (fault,)
    with pytest.raises(UserError) as empty, rendered_errors():
        raise UserError([])
    assert str(empty.value) == ""


def test_several_problems_are_all_in_the_text() -> None:
    faults = [Diagnostic("AE130", "`x` is no module"), Diagnostic("AE101", "`y` is no field")]
    with pytest.raises(UserError) as raised, rendered_errors():
        raise UserError(faults)
    assert str(raised.value).startswith("error[AE130] no-module: `x` is no module\n")
    assert "error[AE101] unknown-field: `y` is no field\n" in str(raised.value)


def test_the_place_of_a_problem_is_underlined() -> None:
    span = Source("site.yaml", "id: bench\n").span(4, 9)
    with pytest.raises(UserError) as raised, rendered_errors():
        raise UserError([Diagnostic("AE101", "`bench` is no field", SpanLabel(span, "here"))])
    assert "--> site.yaml:1:5\n" in str(raised.value)
    assert "^^^^^ here\n" in str(raised.value)


def test_other_errors_pass_as_they_are() -> None:
    with pytest.raises(ValueError, match=r"^as it is$"), rendered_errors():
        raise ValueError("as it is")
    with rendered_errors():
        pass
