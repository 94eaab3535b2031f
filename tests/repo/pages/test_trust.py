from __future__ import annotations

import ast
import re

import pytest

from aeros.spec.diagnostics.codes import CODES
from tests.repo.tree import PYTHON, text_of

_PAGE = text_of("docs/trust.md")
_ROWS = re.findall(r"^\| ((?:AE\d{3}(?:, )?)+) \| .+ \| `(.+?)::(\w+)` \|$", _PAGE, re.MULTILINE)
_NAMED = re.findall(r"`(tests/[\w/]+\.py)::(\w+)`", _PAGE)


def _codes_of_obligations() -> set[str]:
    """Codes that are string constants in what builds obligations."""
    return {
        node.value
        for path in PYTHON
        if path.is_relative_to("aeros/spec/obligations")
        for node in ast.walk(ast.parse(text_of(path)))
        if isinstance(node, ast.Constant) and node.value in CODES
    }


def test_every_code_of_an_obligation_is_in_the_table_and_no_other() -> None:
    listed = {code for codes, _, _ in _ROWS for code in codes.split(", ")}
    assert listed == _codes_of_obligations()


@pytest.mark.parametrize(("path", "test"), _NAMED)
def test_the_test_that_is_named_exists(path: str, test: str) -> None:
    functions = {node.name for node in ast.parse(text_of(path)).body if isinstance(node, ast.FunctionDef)}
    assert test in functions


@pytest.mark.parametrize(("codes", "path"), [(codes, path) for codes, path, _ in _ROWS])
def test_the_test_of_a_code_speaks_of_it(codes: str, path: str) -> None:
    """By name, beside what is compared: `Mix.assert_both` requires that both verdicts were met of each."""
    text = text_of(path)
    assert [code for code in codes.split(", ") if f'"{code}"' not in text] == []
