"""Names in manifests and sites: identifiers, slugs and words for risk."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from aeros.spec.declared.decode import decode
from aeros.spec.declared.field_types import Identifier, Named, RiskWord, Slug
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.source import Source, SourceSpan
from aeros.spec.text.yaml_reader import read_yaml


@dataclass(frozen=True)
class Record:
    span: SourceSpan
    name: Identifier | None = None
    slug: Slug | None = None
    risk: RiskWord | None = None
    by_name: Named[Slug] | None = None


@pytest.mark.parametrize(
    ("text", "accepted"),
    [
        ("name: move_tool", True),
        ("name: move-tool", False),
        ("slug: move-tool", True),
        ("slug: Move", False),
        ("risk: medium", True),
        ("risk: extreme", False),
        ("by_name: {move_tool: a-slug}", True),
        ("by_name: {move-tool: a-slug}", False),
    ],
)
def test_a_field_accepts_its_own_form_alone(text: str, accepted: bool) -> None:
    sink = Diagnostics()
    node = read_yaml(Source("record.yaml", text), sink)
    assert node is not None
    assert (decode(node, Record, sink) is not None) is accepted
