"""YAML nodes, nothing interpreted."""

from __future__ import annotations

import pytest

from aeros.spec.diagnostics.source import Source
from aeros.spec.text.nodes import ScalarNode

SPAN = Source("a.yaml", "x").span(0, 1)


@pytest.mark.parametrize("text", ["", "~", "null", "Null", "NULL"])
def test_only_a_plain_scalar_is_null(text: str) -> None:
    assert ScalarNode(text, SPAN).is_null
    assert not any(ScalarNode(text, SPAN, style).is_null for style in ("'", '"', "|", ">"))


@pytest.mark.parametrize("text", ["nULL", "none", "0", "false", " "])
def test_other_words_are_not_null(text: str) -> None:
    assert not ScalarNode(text, SPAN).is_null


def test_a_scalar_is_plain_without_quotes_and_block_signs() -> None:
    assert [ScalarNode("a", SPAN, style).is_plain for style in ("", "'", '"', "|", ">")] == [True] + [
        False
    ] * 4
