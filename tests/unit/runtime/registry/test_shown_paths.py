from __future__ import annotations

from pathlib import Path

import pytest

from aeros.runtime.registry.shown_paths import shown_as
from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel
from aeros.spec.diagnostics.errors import UndecidedError, UserError
from aeros.spec.diagnostics.source import Source


def test_errors_name_the_file_that_the_user_named() -> None:
    span = Source("/kept/a/ecm.yaml", "id: /kept/a\n").span(4, 11)
    problem = Diagnostic(
        "AE961", "`/kept/a` is odd", SpanLabel(span, "here"), notes=("/kept/a/x",), help=("fix /kept/a",)
    )
    with pytest.raises(UndecidedError) as raised, shown_as(Path("/kept/a"), Path("mine")):
        raise UndecidedError([problem])
    (found,) = raised.value.diagnostics
    assert (found.headline, found.notes, found.help) == ("`mine` is odd", ("mine/x",), ("fix mine",))
    assert found.primary is not None
    assert found.primary.span.source.path == "mine/ecm.yaml"
    assert found.primary.span.text == "/kept/a"


def test_other_errors_pass() -> None:
    with pytest.raises(KeyError), shown_as(Path("a"), Path("b")):
        raise KeyError("a")
    with pytest.raises(UserError, match="no path"), shown_as(Path("/kept"), Path("b")):
        raise UserError([Diagnostic("AE961", "no path")])
