"""The error for a required module that is missing."""

from __future__ import annotations

from aeros.spec.diagnostics.missing_module import missing_module
from aeros.spec.diagnostics.source import Source, SourceSpan


def test_the_error_names_both_modules_and_the_places_where_the_other_is_looked_for() -> None:
    source = Source("asker/ecm.yaml", "modules: {helper: 1}\n")
    found = missing_module("AE301", "asker", "helper", SourceSpan(source, 10, 16))
    assert found.code == "AE301"
    assert found.headline == "`asker` needs `helper`, which is missing or cannot be read"
    assert found.primary is not None
    assert found.primary.span.start == 10
    assert found.help[0].startswith("put the folder of `helper` next to that of `asker`, or name both")
