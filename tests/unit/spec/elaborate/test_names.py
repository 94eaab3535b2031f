"""Names that are declared or referred to, and what is suggested for an unknown one."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.source import Source
from aeros.spec.elaborate.names import check_name_is_free, resolve_name, resolve_site_name
from aeros.spec.text.fields import TextField
from aeros.spec.text.nodes import ScalarNode


def field(text: str) -> TextField:
    span = Source("file.yaml", text).span(0, len(text))
    return TextField(text, span, ScalarNode(text, span))


@pytest.mark.parametrize(
    ("name", "headline"),
    [
        ("implies", "`implies` is a word of the expression language"),
        ("clamp", "`clamp` is a word of the expression language"),
        ("mm", "`mm` is a word of the expression language"),
        ("speed", "`speed` is already a constant"),
        ("pace", None),
    ],
)
def test_a_name_is_free_unless_it_has_a_meaning(name: str, headline: str | None) -> None:
    sink = Diagnostics()
    free = check_name_is_free(field(name), {"speed": "a constant"}, "parameter", sink)
    assert free == (headline is None)
    assert [one.headline for one in sink] == ([] if headline is None else [headline])


@pytest.mark.parametrize(
    ("resolve", "listed"), [(resolve_name, "declared here: "), (resolve_site_name, "the site declares ")]
)
def test_an_unknown_name_is_reported_with_a_suggestion(
    resolve: Callable[..., int | None], listed: str
) -> None:
    sink = Diagnostics()
    among = {"grip": 1, "move": 2}
    assert resolve(field("grip"), among, "an action kind", sink) == 1
    assert len(sink) == 0
    assert resolve(field("gripp"), among, "an action kind", sink) is None
    assert resolve(field("zzz"), among, "an action kind", sink) is None
    assert {one.headline: one.help for one in sink} == {
        "`gripp` is not an action kind": ("did you mean `grip`?",),
        "`zzz` is not an action kind": (f"{listed}`grip`, `move`",),
    }
