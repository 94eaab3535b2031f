from __future__ import annotations

import json
import re
import shutil
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import pytest
from jsonschema import Draft4Validator

from aeros.cli.author.reports import sarif
from aeros.cli.author.reports.result import VerifyResult
from aeros.cli.author.reports.sarif import as_sarif
from aeros.spec.diagnostics.codes import CODES, Diagnostic, Severity, SpanLabel
from aeros.spec.diagnostics.source import Source
from aeros.spec.obligations.verdicts import Conclusion
from aeros.spec.verification.verify import verify
from tests.repo.tree import ROOT
from tests.unit.cli.author.reports.results import CORPUS, RUNS, diagnostic_at, result_of, result_with

SCHEMA = json.loads((Path(__file__).parent / "data" / "sarif-2.1.0-rtm.5.json").read_text(encoding="utf-8"))
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
VALIDATOR = Draft4Validator(SCHEMA)


@pytest.fixture(autouse=True)
def in_the_corpus(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(CORPUS)


def run_of(result: VerifyResult) -> dict[str, Any]:
    log = json.loads(as_sarif(result))
    assert [error.message for error in VALIDATOR.iter_errors(log)] == []
    (run,) = log["runs"]
    assert isinstance(run, dict)
    return run


def fingerprints(*diagnostics: Diagnostic) -> list[str]:
    return [one["partialFingerprints"]["aeros/v1"] for one in run_of(result_with(*diagnostics))["results"]]


@pytest.mark.parametrize("name", RUNS)
def test_the_log_is_valid_and_holds_every_diagnostic(name: str) -> None:
    result = result_of(name)
    run = run_of(result)
    problems = [problem.diagnostic for problem in result.problems]
    assert sorted(one["ruleId"] for one in run["results"]) == sorted(problem.code for problem in problems)
    for one in run["results"]:
        assert run["tool"]["driver"]["rules"][one["ruleIndex"]]["id"] == one["ruleId"]
        for location in [*one.get("locations", ()), *one.get("relatedLocations", ())]:
            uri = location["physicalLocation"]["artifactLocation"]["uri"]
            assert not urlsplit(uri).scheme
            assert not uri.startswith(("/", ".."))
    keys = [one["partialFingerprints"]["aeros/v1"] for one in run["results"]]
    assert len(set(keys)) == len(keys)


def test_every_result_about_a_file_has_a_location_that_exists() -> None:
    for one in run_of(result_of("many modules"))["results"]:
        (location,) = one["locations"]
        path = CORPUS / unquote(location["physicalLocation"]["artifactLocation"]["uri"])
        assert path.is_file() or path.name == "ecm.lock"


def test_regions_are_the_underlined_text_counted_in_code_points() -> None:
    text = "one: 1\ntwo: '𝔘ñ' # 𝔘\nthree: 3\n"
    run = run_of(result_with(diagnostic_at(text, "# 𝔘\nthree"), diagnostic_at(text, "'𝔘ñ'")))
    assert run["columnKind"] == "unicodeCodePoints"
    lines = text.split("\n")
    regions = [one["locations"][0]["physicalLocation"]["region"] for one in run["results"]]
    assert regions[0] == {"startLine": 2, "startColumn": 11, "endLine": 3, "endColumn": 6}
    assert lines[1][regions[1]["startColumn"] - 1 : regions[1]["endColumn"] - 1] == "'𝔘ñ'"


def test_secondary_labels_are_related_locations() -> None:
    (result,) = (one for one in run_of(result_of("rejected"))["results"] if one["ruleId"] == "AE501")
    (related,) = result["relatedLocations"]
    assert related["id"] == 1
    assert related["message"]["text"] == "`slow-near-person` forbids it"
    assert related["physicalLocation"]["artifactLocation"]["uri"] == "site/table.yaml"
    assert "pace = 0.2 m/s" in result["message"]["text"]
    assert "help: tighten the envelope" in result["message"]["text"]


def test_levels_are_the_severities_and_the_gravest_come_first() -> None:
    found = [
        diagnostic_at("a", "a", severity=severity)
        for severity in (Severity.NOTE, Severity.WARNING, Severity.ERROR)
    ]
    assert [one["level"] for one in run_of(result_with(*found))["results"]] == ["error", "warning", "note"]


def test_a_rule_says_what_the_registry_says() -> None:
    (rule,) = run_of(result_of("vacuous"))["tool"]["driver"]["rules"][:1]
    assert rule["name"] == "EmptyEnvelope"
    assert (
        rule["shortDescription"]["text"] == "an envelope contains no action, so proofs about it say nothing"
    )
    assert rule["properties"]["tags"] == ["safety"]
    assert "`aeros explain AE503`" in rule["help"]["text"]
    assert rule["help"]["markdown"].startswith("# AE503")


def test_a_rule_names_its_page_in_the_repository() -> None:
    for rule in run_of(result_of("many modules"))["tool"]["driver"]["rules"]:
        address, _, page = rule["helpUri"].partition("/blob/main/")
        assert address == PROJECT["urls"]["Repository"]
        assert (ROOT / page).read_text(encoding="utf-8").startswith(f"# {rule['id']}")


def test_runs_under_one_site_are_one_category_of_code_scanning() -> None:
    ids = {name: run_of(result_of(name))["automationDetails"]["id"] for name in ("accepted", "rejected")}
    assert ids == dict.fromkeys(ids, "aeros/verify/table/")


def test_a_site_that_cannot_be_read_and_a_hostile_name_make_a_category() -> None:
    unreadable = result_with(name="module")
    site = replace(unreadable.report.site, name="site.yaml", is_readable=False)
    assert run_of(replace(unreadable, report=replace(unreadable.report, site=site)))["automationDetails"] == {
        "id": "aeros/verify/unreadable-site/"
    }
    site = replace(site, name="a/b c", is_readable=True)
    assert run_of(replace(unreadable, report=replace(unreadable.report, site=site)))["automationDetails"] == {
        "id": "aeros/verify/a%2Fb%20c/"
    }


def test_a_fingerprint_stays_when_lines_move_and_numbers_of_a_witness_change() -> None:
    before = diagnostic_at("a: 1\n", "a")
    after = replace(diagnostic_at("# new\n\n  a: 1\n", "a"), notes=("for example, with\nx = 2",))
    assert fingerprints(before) == fingerprints(after)


def test_a_fingerprint_depends_on_code_file_headline_text_and_repetition() -> None:
    one = diagnostic_at("a: b\n", "a")
    others = [
        replace(one, code="AE102"),
        replace(one, headline="otherwise"),
        diagnostic_at("a: b\n", "b"),
        diagnostic_at("a: b\n", "a", path="b.yaml"),
        diagnostic_at("b\na", "a"),
    ]
    assert len(set(fingerprints(one, *others))) == 6


def test_a_diagnostic_without_a_place_is_about_its_manifest() -> None:
    (one,) = run_of(result_with(Diagnostic("AE130", "nothing"), path=Path("deep down/mödule")))["results"]
    uri = one["locations"][0]["physicalLocation"]["artifactLocation"]["uri"]
    assert uri == "deep%20down/m%C3%B6dule/ecm.yaml"


def test_a_file_outside_the_working_folder_is_absolute() -> None:
    (one,) = run_of(result_with(diagnostic_at("a", "a", path="../../x.yaml")))["results"]
    uri = one["locations"][0]["physicalLocation"]["artifactLocation"]["uri"]
    assert uri == "file://" + str(CORPUS.parents[1] / "x.yaml")


def test_hostile_names_are_shown_harmlessly_and_make_no_links() -> None:
    headline = "see [here](https://evil.example) \x1b[31m\u202e\x00"
    path = "x\x1b\udcff/y z.yaml"
    found = diagnostic_at("a", "a", headline=headline, path=path)
    text = as_sarif(result_with(found, name="\ud800", path=Path(path)))
    assert text.isascii()
    (one,) = run_of(result_with(found))["results"]
    shown = one["message"]["text"]
    assert not re.search(r"[\x00-\x09\x0b-\x1f\u202e]|\]\(", shown)
    assert one["locations"][0]["physicalLocation"]["artifactLocation"]["uri"] == "x%1B%FF/y%20z.yaml"


def many(count: int, headline: str = "wrong") -> VerifyResult:
    source = Source("a.yaml", "x" * count)
    found = [Diagnostic("AE101", headline, SpanLabel(source.span(n, n + 1))) for n in range(count)]
    return result_with(Diagnostic("AE505", "needless", severity=Severity.WARNING), *found)


def test_the_limits_are_those_of_code_scanning() -> None:
    assert (sarif.MAX_RESULTS, sarif.MAX_BYTES) == (25_000, 10_000_000)


def test_more_results_than_are_allowed_are_left_out_and_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sarif, "MAX_RESULTS", 250)
    run = run_of(many(260))
    assert len(run["results"]) == 250
    assert {one["level"] for one in run["results"]} == {"error"}
    (notification,) = run["invocations"][0]["toolExecutionNotifications"]
    assert notification["level"] == "warning"
    assert notification["message"]["text"].startswith("11 results are left out of this file")
    assert "the exit code counts them all" in notification["message"]["text"]
    assert run["invocations"][0]["executionSuccessful"] is True


def test_a_log_never_grows_beyond_its_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sarif, "MAX_BYTES", 1_300_000)
    text = as_sarif(many(1_000, "é" * 200))
    assert len(text.encode()) <= 1_300_000
    (run,) = json.loads(text)["runs"]
    kept = len(run["results"])
    assert 50 < kept < 1_000
    (notification,) = run["invocations"][0]["toolExecutionNotifications"]
    assert notification["message"]["text"].startswith(f"{1_001 - kept} results")
    assert [error.message for error in VALIDATOR.iter_errors(json.loads(text))] == []


def test_rules_of_every_code_fit_into_the_bytes_kept_for_them() -> None:
    found = [Diagnostic(code, "wrong") for code in CODES]
    run = run_of(result_with(*found))
    assert len(json.dumps(run["tool"])) < sarif._RESERVED - 1_000


def test_a_repair_is_an_edit_that_mends_what_the_result_is_about(tmp_path: Path) -> None:
    """Applied as a client of SARIF does, to the file, the fix leaves nothing to say."""
    module = tmp_path / "unit_slip"
    shutil.copytree(CORPUS / "rejected" / "safety" / "a_millimetre_per_second_too_fast", module)
    manifest = module / "ecm.yaml"
    site = CORPUS / "site" / "table.yaml"
    found = run_of(VerifyResult(verify([module], site), ()))["results"]
    fixes = [fix for one in found for fix in one.get("fixes", ())]
    (change,) = fixes[0]["artifactChanges"]
    assert change["artifactLocation"]["uri"] == f"file://{manifest}"
    (replacement,) = change["replacements"]
    region, lines = replacement["deletedRegion"], manifest.read_text(encoding="utf-8").splitlines()
    assert region["startLine"] == region["endLine"]
    line = lines[region["startLine"] - 1]
    before, after = line[: region["startColumn"] - 1], line[region["endColumn"] - 1 :]
    lines[region["startLine"] - 1] = before + replacement["insertedContent"]["text"] + after
    manifest.write_text("\n".join(lines) + "\n", encoding="utf-8")
    assert verify([module], site).conclusion is Conclusion.PROVED
