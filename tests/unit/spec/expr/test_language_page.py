"""Page about the language: it agrees with the code."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from aeros.spec.expr import parser
from aeros.spec.expr.typecheck import check, desugar
from aeros.spec.expr.units import unit_names

_PAGE = (Path(__file__).parents[4] / "docs" / "language.md").read_text(encoding="utf-8")
_RULE = re.compile(r"[a-z]+ := .+")


def test_the_grammar_is_that_of_the_parser() -> None:
    documented = [method.__doc__ or "" for method in vars(parser._Parser).values() if callable(method)]
    rules = [rule for text in documented for rule in _RULE.findall(text)]
    assert re.findall(r"^[a-z]+ := .+$", _PAGE, re.MULTILINE) == rules


def test_every_nonterminal_is_defined_or_explained() -> None:
    grammar = _PAGE.split("## Grammar")[1]
    rules = dict(line.split(" := ") for line in re.findall(r"^[a-z]+ := .+$", grammar, re.MULTILINE))
    used = {word for rule in rules.values() for word in re.findall(r"[a-z]+", re.sub(r"'[^']*'", "", rule))}
    assert used - set(rules) == {"end", "name", "number", "truth", "unit"}


def test_every_unit_is_listed() -> None:
    listed = next(text for text in _PAGE.split("\n\n") if text.startswith("`1` `%`"))
    assert tuple(re.findall(r"`([^`]+)`", listed)) == unit_names()


def test_every_function_and_keyword_is_shown() -> None:
    for word in (*desugar.ARITY, *parser.KEYWORDS):
        assert re.search(rf"`[^`\n]*\b{word}\b[^`\n]*`", _PAGE), word


@pytest.mark.parametrize(
    "limit",
    [parser.MAX_LENGTH, parser.MAX_DEPTH, parser.MAX_HEIGHT, check.MAX_SIZE, check.MAX_HEIGHT],
)
def test_every_limit_is_stated_or_rounded_in_words(limit: int) -> None:
    words = {50_000: "50 000 nodes", 100: "100 high"}
    assert words.get(limit, str(limit)) in _PAGE


def test_the_examples_at_the_top_parse() -> None:
    examples = _PAGE.split("```text\n")[1].split("```")[0].splitlines()
    assert len(examples) == 6
    for example in examples:
        parser.parse(example)
