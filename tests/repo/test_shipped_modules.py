"""The modules of this repository declare nothing that only they could know."""

from __future__ import annotations

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.text.discovery import reference_site_path
from tests.repo.tree import ROOT

MODULES = sorted(path.parent.name for path in (ROOT / "ecms").glob("*/ecm.yaml"))


@pytest.mark.parametrize("module", MODULES)
def test_every_success_is_one_that_can_be_measured(module: str) -> None:
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    loaded = load_ecm(ROOT / "ecms" / module, site, Diagnostics())
    assert loaded is not None
    believed = [
        f"{skill.id}: {outcome.id}"
        for skill in loaded.ecm.skills.values()
        for outcome in skill.outcomes.values()
        if not outcome.failure and not outcome.effects
    ]
    assert believed == []
