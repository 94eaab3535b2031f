from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.policy import OperatorOverride
from aeros.spec.model.summary import summarize_module, summarize_site
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.configuration import configuration_obligations
from aeros.spec.obligations.verdicts import Conclusion
from aeros.spec.text.discovery import reference_site_path
from aeros.spec.verification.reports import Report
from aeros.spec.verification.verify import verify

ROOT = Path(__file__).parents[4]
ECMS = sorted(path.parent for path in (ROOT / "ecms").glob("*/ecm.yaml"))
CORPUS = ROOT / "tests" / "corpus"
TABLE = CORPUS / "site" / "table.yaml"


def _codes(report: Report) -> list[str]:
    assert report.configuration is not None
    return sorted(one.code for one in report.configuration.diagnostics)


def test_one_module_has_no_configuration_report() -> None:
    report = verify([ECMS[0]], reference_site_path())
    assert report.configuration is None
    assert report.subjects == (report.site, *report.modules)


def test_the_modules_that_come_with_aeros_go_together() -> None:
    report = verify([ROOT / "ecms"], reference_site_path())
    assert report.configuration is not None
    assert report.configuration.conclusion is Conclusion.PROVED
    assert _codes(report) == []
    assert report.subjects[-1] is report.configuration


def test_no_module_may_do_more_because_another_is_there() -> None:
    # Certificates say everything that the gate takes from a proof, so they are what has to stay.
    together = verify(ECMS, reference_site_path())
    for folder, beside in zip(ECMS, together.modules, strict=True):
        alone = verify([folder], reference_site_path()).modules[0]
        assert alone.certificate == beside.certificate
        assert alone.ecm is not None
        assert beside.ecm is not None
        assert together.site_model is not None
        access = together.site_model.access_of(alone.ecm.id)
        assert access == together.site_model.access.merge(
            together.site_model.grants.get(folder.name, type(access)())
        )


def test_a_module_that_takes_the_name_of_another_is_refused(tmp_path: Path) -> None:
    first = shutil.copytree(CORPUS / "accepted" / "granted_the_wheels", tmp_path / "first")
    second = shutil.copytree(CORPUS / "accepted" / "always_slow", tmp_path / "second")
    manifest = second / "ecm.yaml"
    manifest.write_text(manifest.read_text().replace("id: always_slow", "id: granted_the_wheels"))
    report = verify([first, second], TABLE)
    assert report.conclusion is Conclusion.REJECTED
    assert {module.conclusion for module in report.modules} == {Conclusion.PROVED}
    assert "AE881" in _codes(report)


def test_a_grant_for_an_absent_module_is_reported() -> None:
    named = CORPUS / "accepted" / "granted_the_wheels"
    others = [CORPUS / "accepted" / name for name in ("always_slow", "two_volumes")]
    waiting = verify(others, TABLE).configuration
    assert waiting is not None
    grants = [one for one in waiting.diagnostics if "granted_the_wheels" in one.headline]
    assert [one.code for one in grants] == ["AE886"]
    assert grants[0].primary is not None
    assert grants[0].primary.span.text == "granted_the_wheels"
    assert waiting.conclusion is Conclusion.PROVED
    taken = verify([*others, named], TABLE).configuration
    assert taken is not None
    assert not any("granted_the_wheels" in one.headline for one in taken.diagnostics)


def test_an_override_for_an_absent_module_is_reported() -> None:
    site = load_site(TABLE, Diagnostics())
    assert site is not None
    ecms = [
        load_ecm(CORPUS / "accepted" / name, site, Diagnostics()) for name in ("always_slow", "two_volumes")
    ]
    blocks = (
        OperatorOverride("everything", "", None, None, "wait"),
        OperatorOverride("a-module", "", "always_slow", None, None),
        OperatorOverride("a-skill", "", "always_slow", "tidy", None),
        OperatorOverride("no-module", "", "gone", None, None),
        OperatorOverride("no-skill", "", "two_volumes", "gone", None, site.span),
    )
    claims = configuration_obligations(
        [summarize_module(one.ecm) for one in ecms if one], summarize_site(replace(site, blocks=blocks))
    )
    reported = {one.id: one.diagnostic for one in claims if one.id.form is ClaimForm.BLOCK_IS_USED}
    assert {id_.name_of("block"): one and one.headline for id_, one in reported.items()} == {
        "a-module": None,
        "a-skill": None,
        "no-module": "the operator override `no-module` blocks `gone`, which is not in this set",
        "no-skill": "the operator override `no-skill` blocks `two_volumes.gone`, which is not in this set",
    }


def test_a_shared_variable_of_an_absent_module_is_reported() -> None:
    site = load_site(TABLE, Diagnostics())
    assert site is not None
    found = load_ecm(CORPUS / "accepted" / "reads_what_another_shares" / "gauge", site, Diagnostics())
    assert found is not None
    gauge = summarize_module(found.ecm)
    assert gauge.variables == {"dial_green": ()}
    claims = configuration_obligations([gauge], summarize_site(site))
    reported = {one.id: one.diagnostic for one in claims if one.id.form is ClaimForm.SHARED_IS_USED}
    assert {id_.name_of("variable"): one and one.headline for id_, one in reported.items()} == {
        "gauge.dial_green": None,
        "shared_with_another_range.water": "the site shares `shared_with_another_range.water`, but "
        "`shared_with_another_range` is not in this set, so the value is never known",
    }


def test_a_dependency_in_a_sibling_folder_is_not_part_of_the_set(tmp_path: Path) -> None:
    case = CORPUS / "accepted" / "modules_that_need_each_other_in_one_direction"
    for name in ("asker", "helper"):
        shutil.copytree(case / name, tmp_path / name)
    shutil.copytree(CORPUS / "accepted" / "always_slow", tmp_path / "always_slow")
    report = verify([tmp_path / "asker", tmp_path / "always_slow"], TABLE)
    assert [module.conclusion for module in report.modules] == [Conclusion.PROVED, Conclusion.PROVED]
    assert "AE884" in _codes(report)
    assert "AE884" not in _codes(verify([tmp_path], TABLE))


@pytest.mark.parametrize("count", [200])
def test_many_modules_are_compared_quickly(tmp_path: Path, count: int) -> None:
    # Near-linear: no two modules are compared with each other for every pair there is.
    site = load_site(TABLE, Diagnostics())
    assert site is not None
    source = CORPUS / "accepted" / "handler_that_leads_back"
    ecms = []
    for number in range(count):
        folder = shutil.copytree(source, tmp_path / f"m{number}")
        text = (folder / "ecm.yaml").read_text()
        text = text.replace("id: handler_that_leads_back", f"id: m{number}")
        (folder / "ecm.yaml").write_text(text.replace("[tidy]\n    goal", f"[tidy{number}]\n    goal"))
        found = load_ecm(folder, site, Diagnostics())
        assert found is not None
        ecms.append(summarize_module(found.ecm))
    claims = list(configuration_obligations(ecms, summarize_site(site)))
    assert len(claims) < 3 * count + 20
    assert {one.diagnostic.code for one in claims if one.diagnostic} == {"AE883", "AE886"}
