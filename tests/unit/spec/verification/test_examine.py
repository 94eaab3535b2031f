"""A site and a module are proved by themselves, and each failure is reported once."""

from __future__ import annotations

import gc
import shutil
import signal
from dataclasses import replace
from pathlib import Path

import pytest

from aeros.spec.backends.oracle import Oracle
from aeros.spec.diagnostics.codes import Diagnostics, Fix, Severity, SpanLabel
from aeros.spec.diagnostics.source import Source
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.operator_settings import OperatorSettings
from aeros.spec.model.policy import OperatorOverride
from aeros.spec.model.site import Site
from aeros.spec.obligations.obligation import Obligation
from aeros.spec.obligations.safety import safety_obligations
from aeros.spec.obligations.verdicts import Conclusion, Verdict
from aeros.spec.text.discovery import NEIGHBOURS
from aeros.spec.verification import examine
from aeros.spec.verification.discharge import ObligationResult, discharge_obligations
from aeros.spec.verification.examine import (
    diagnostic_of,
    examine_module,
    examine_site,
    summarize_folder,
)
from tests.unit.spec.obligations.data.tidier import Change, module, site

ORACLE = Oracle()
BASE = Path(__file__).parents[4] / "docs" / "codes" / "base"


def source(*changes: Change) -> Source:
    text = (BASE / "site.yaml").read_text(encoding="utf-8")
    for old, new in changes:
        assert text.count(old) == 1
        text = text.replace(old, new)
    return Source(str(BASE / "site.yaml"), text)


@pytest.fixture(scope="module")
def bench() -> Site:
    found = load_site(BASE / "site.yaml", Diagnostics())
    assert found is not None
    return found


def tidy(folder: Path, *changes: Change) -> Path:
    path = Path(shutil.copytree(BASE / "tidy", folder / "tidy"))
    text = (path / "ecm.yaml").read_text(encoding="utf-8")
    for old, new in changes:
        assert text.count(old) == 1
        text = text.replace(old, new)
    (path / "ecm.yaml").write_text(text, encoding="utf-8")
    return path


def test_a_site_is_proved_with_its_joint_rules_and_quotas() -> None:
    found, report = examine_site(source(), ORACLE)
    assert found is not None
    assert (report.name, report.conclusion, report.diagnostics) == ("bench", Conclusion.PROVED, ())
    assert report.claim_count == len(report.static_claims) + len(report.findings) == len(report.claims)
    assert {str(one.id).partition("/")[0] for one in report.claims} == {"policy"}


def test_a_rule_that_denies_nothing_is_reported_once() -> None:
    _, report = examine_site(source(("require: force <= 30 N", "require: force <= 300 N")), ORACLE)
    assert report.conclusion is Conclusion.REJECTED
    assert [one.code for one in report.diagnostics] == ["AE603"]
    failed = [one.obligation.code for one in report.findings if one.verdict is not Verdict.PROVED]
    assert failed == ["AE603", "AE604"]


def test_a_site_that_cannot_be_read_is_rejected_by_its_path() -> None:
    found, report = examine_site(source(("risk_ceiling: medium", "risk_ceiling: none")), ORACLE)
    assert found is None
    assert (report.name, report.conclusion, len(report.claims)) == (
        str(BASE / "site.yaml"),
        Conclusion.REJECTED,
        0,
    )
    assert report.diagnostics


def test_overrides_of_an_operator_are_part_of_the_site() -> None:
    stop = OperatorOverride("no-stop", "a test", None, None, "stop")
    found, report = examine_site(source(), ORACLE, OperatorSettings((stop,)))
    assert found is not None
    assert stop in found.blocks
    assert [one.code for one in report.diagnostics] == ["AE602"]


def test_a_module_is_proved_with_its_code(bench: Site, tmp_path: Path) -> None:
    found = examine_module(tidy(tmp_path), bench, ORACLE)
    assert found.summary is not None
    assert found.summary.id == "tidy"
    assert found.first_problems == found.last_problems == ()
    before, after = found.claims.read()
    groups = [[str(one.id).partition("/")[0] for one in part] for part in (before, after)]
    assert set(groups[0]) == {"form", "dependencies"}
    assert set(groups[1]) == {"permission", "safety", "composition", "closed-loop"}
    assert found.findings is not None
    ecm, static, settled, findings = found.findings
    assert ecm.id == "tidy"
    assert (len(static), len(settled) + len(findings)) == (len(before), len(after))


def test_a_fault_of_the_code_comes_before_one_of_the_envelope(bench: Site, tmp_path: Path) -> None:
    path = tidy(tmp_path, ("grip: force <= 10 N", "grip: force <= 20 N"))
    code = (path / "skills.py").read_text()
    (path / "skills.py").write_text(code.replace("from aeros.skill", "import os\nfrom aeros.skill"))
    found = examine_module(path, bench, ORACLE)
    assert [one.code for one in found.first_problems] == ["AE134"]
    assert [one.code for one in found.last_problems] == ["AE403"]


def test_a_module_that_cannot_be_read_has_its_faults_alone(bench: Site, tmp_path: Path) -> None:
    path = tidy(tmp_path, ("risk: low", "risk: none"))
    found = examine_module(path, bench, ORACLE)
    assert (found.summary, found.findings, found.claims.read()) == (None, None, ((), ()))
    assert len(found.first_problems) == 1
    assert summarize_folder(path, bench) is None


def test_a_module_is_summarized_without_a_proof(bench: Site, tmp_path: Path) -> None:
    path = tidy(tmp_path)
    assert summarize_folder(path, bench) == examine_module(path, bench, ORACLE).summary


def test_an_envelope_that_holds_nothing_is_reported_once(bench: Site, tmp_path: Path) -> None:
    found = examine_module(tidy(tmp_path, ("grip: force <= 10 N", "grip: force < 0 N")), bench, ORACLE)
    assert [one.code for one in found.last_problems] == ["AE503"]


def test_a_rule_that_need_not_be_left_to_the_gate_is_warned_of(bench: Site, tmp_path: Path) -> None:
    needless = ("    timeout: 30 s\n", "    timeout: 30 s\n    gated: [slow-near-person]\n")
    found = examine_module(tidy(tmp_path, needless), bench, ORACLE)
    assert [(one.code, one.severity) for one in found.last_problems] == [("AE505", Severity.WARNING)]
    needed = ("speed <= 250 mm/s", "speed <= 400 mm/s")
    (tmp_path / "again").mkdir()
    assert examine_module(tidy(tmp_path / "again", needless, needed), bench, ORACLE).last_problems == ()


def findings(*changes: Change) -> dict[str, ObligationResult]:
    claims = [one for one in safety_obligations(module(*changes), site()) if isinstance(one, Obligation)]
    return {str(one.obligation.id): one for one in discharge_obligations(claims, ORACLE)}


REACH = "reach: distance(hand, goal) <= 100 mm"


def test_proved_and_runtime_checked_rules_are_not_reported() -> None:
    assert all(diagnostic_of(one) is None for one in findings().values())


def test_a_breach_is_reported_with_an_example_and_its_remedies() -> None:
    found = findings((REACH, "reach: true"))["safety/fetch/reach/short-reach"]
    diagnostic = diagnostic_of(found)
    assert diagnostic is not None
    assert (diagnostic.code, diagnostic.primary, diagnostic.secondary) == (
        "AE501",
        found.obligation.primary,
        found.obligation.secondary,
    )
    assert diagnostic.notes[0].startswith("for example, with\nhand = ")
    assert (diagnostic.help, diagnostic.fix) == (found.obligation.help, None)
    assert found.obligation.clause is not None
    span = found.obligation.clause.span
    label = SpanLabel(span, "here")
    fix = Fix(span, "x: y")
    repaired = diagnostic_of(replace(found, repair="reach: x: y", fix=fix, labels=(label, label)))
    assert repaired is not None
    assert (repaired.primary, repaired.secondary, repaired.fix) == (label, (label,), fix)
    assert repaired.help == ("write `reach: x: y`", *found.obligation.help)


def test_an_undecided_claim_is_reported_as_undecided_even_where_the_gate_would_decide() -> None:
    found = findings()["safety/fetch/reach/stop-button"]
    diagnostic = diagnostic_of(
        replace(found, verdict=Verdict.UNKNOWN, witness=None, reason="the budget is spent")
    )
    assert diagnostic is not None
    assert (diagnostic.code, diagnostic.notes) == ("AE509", ("the solver said: the budget is spent",))
    assert diagnostic.headline == "undecided, so refused: safety/fetch/reach/stop-button"


def test_a_worker_process_finds_what_this_one_finds_without_the_model(
    bench: Site, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A worker's code, run in this process; tests of the proof cache start real workers."""
    done: list[object] = []
    monkeypatch.setattr(signal, "signal", lambda *to: done.append(to))
    monkeypatch.setattr(gc, "disable", lambda: done.append("no garbage collection"))
    monkeypatch.setattr(examine, "_WORKER_STATE", {})
    block = OperatorOverride("no-grip", "a test", None, None, "grip")
    path = tidy(tmp_path)
    examine._init_worker(source(), OperatorSettings((block,)), 1_000_000, 10.0, NEIGHBOURS)
    found = examine._verify_in_worker(path)
    assert done == [(signal.SIGINT, signal.SIG_IGN), "no garbage collection"]
    alone = examine_module(path, bench.with_overrides([block]), ORACLE)
    assert (found.summary, found.last_problems) == (alone.summary, alone.last_problems)
    assert [one.code for one in found.last_problems] == ["AE408"]
    assert found.findings is None
