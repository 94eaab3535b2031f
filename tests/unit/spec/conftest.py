"""A module of one skill under the corpus's site, from the few lines that a test is about."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.verification.reports import SubjectReport
from aeros.spec.verification.verify import verify

TABLE = Path(__file__).parents[2] / "corpus" / "site" / "table.yaml"

_MANIFEST = """\
schema: aeros/ecm/2
id: module
version: 1.0.0
description: What a test is about.
license: Apache-2.0
capabilities:
  tidying: {{description: tidies the table, provided_by: [tidy]}}
skills:
  tidy:
    description: tidy the table
    entry: skills:tidy
    precondition: {precondition}
    inputs:
      pause: {{type: real, unit: s, range: [0, 100], default: 1 s}}
    outcomes:
      tidied: {{effects: {{table_tidy: true}}}}
    envelope:
      {kind}: {envelope}
    gated: [{gated}]
    actuators: [arm]
    resources: [arm]
    risk: medium
    timeout: 30 s
permissions:
  actuators: [arm]
  sensors: [camera, scanner, encoders, panel]
  actions:
    {kind}: {permission}
dependencies:
  aeros: ">=0.1"
"""

Judge = Callable[..., SubjectReport]


def _parameters_of(kind: str) -> str:
    """Write parameters for an action kind of the site, none of them a constant."""
    site = load_site(TABLE, Diagnostics())
    assert site is not None
    return ", ".join(f'{name}=inputs["pause"]' for name in site.kinds[kind].parameters)


@pytest.fixture
def judge(tmp_path: Path) -> Judge:
    """Verify a module with a kind of action and its envelope; return the findings."""

    def judged(
        kind: str,
        envelope: str,
        *,
        permission: str = "true",
        precondition: str = "true",
        gated: str = "",
        site: tuple[tuple[str, str], ...] = (),
    ) -> SubjectReport:
        folder = tmp_path / "module"
        folder.mkdir(exist_ok=True)
        text = _MANIFEST.format(
            kind=kind, envelope=envelope, permission=permission, precondition=precondition, gated=gated
        )
        (folder / "ecm.yaml").write_text(text)
        (folder / "skills.py").write_text(
            "from aeros.skill import act\n\n\ndef tidy(observed, inputs):\n"
            f'    yield act("{kind}", {_parameters_of(kind)})\n'
        )
        table = TABLE.read_text()
        for old, new in site:
            assert old in table
            table = table.replace(old, new)
        (tmp_path / "site.yaml").write_text(table)
        (found,) = verify([folder], tmp_path / "site.yaml").modules
        return found

    return judged
