"""The modules of this repository declare nothing that only they could know."""

from __future__ import annotations

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import decode_manifest, load_ecm, load_site
from aeros.spec.elaborate.module.suitable_things import wanted_thing
from aeros.spec.text.discovery import reference_site_path
from tests.repo.tree import ROOT, check_generated

PAGE = "docs/lifecycle.md"
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


def test_the_page_lists_everything_that_a_site_has_to_offer() -> None:
    users: dict[tuple[str, str], list[str]] = {}
    for path in sorted((*ROOT.glob("ecms/*/ecm.yaml"), *ROOT.glob("learned/*/ecm.yaml"))):
        declared = decode_manifest(path.parent)
        assert declared is not None
        for name, need in declared.needs:
            users.setdefault((name.value, wanted_thing(need)), []).append(f"`{path.parent.name}`")
    rows = "| need | is bound to | of |\n|---|---|---|\n"
    for (need_name, thing), modules in users.items():
        rows += f"| `{need_name}` | {thing} | {', '.join(modules)} |\n"
    check_generated(PAGE, "needs", rows)
