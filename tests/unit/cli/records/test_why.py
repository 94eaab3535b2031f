"""`aeros why`: from the audit log alone to the values that were measured and the rules they broke."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from aeros.cli.main import main
from aeros.runtime.audit.log import AuditLog
from tests.repo.tree import ROOT
from tests.unit.apps.why.run_events import DENIED, FAILED, STARTED, Events, note

BASE = ROOT / "docs" / "codes" / "base"


def log(folder: Path, events: Events) -> Path:
    path = folder / "audit.jsonl"
    with AuditLog(path) as audit:
        for event, details in events:
            audit.append(event, details)
    return path


def explained(capsys: pytest.CaptureFixture[str], *arguments: str) -> Any:
    assert main(["why", *arguments, "--format", "json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_a_chain_leads_from_the_end_to_the_value_measured_and_says_what_would_have_to_change(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log(tmp_path, [*DENIED, FAILED])
    assert main(["why", str(tmp_path)]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "tidy.clean: the goal was not reached (`clean`; clean is unknown)",
        "  because   `wipe` was denied  (record 4)",
        "  because   step 1, tidy.wipe: denied  (record 3)",
        "  because   runtime status: ended as denied  (record 2)",
        "  because   the gate denied `grip`  (record 1)",
        "            separation: human_distance is 0.41 m (at least 0.5 m)",
        "               rule `human_distance >= 500 mm`; ISO 13855, cell.yaml:299",
        "  to change human_distance is 0.41 m; at least 0.5 m required by `separation`",
        "  failed    step 1, tidy.wipe: denied: AE750",
    ]


def test_programs_get_the_rule_the_value_and_the_bound(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = explained(capsys, str(log(tmp_path, [*DENIED, FAILED])))
    (cause,) = found["chain"][-1]["causes"]
    assert (cause["kind"], cause["rule"], cause["at"]) == ("rule", "separation", "cell.yaml:299")
    (part,) = cause["shortfalls"]
    assert (part["quantity"], part["value"], part["bound"], part["unit"]) == (
        "human_distance",
        0.41,
        0.5,
        "m",
    )


def test_a_broken_assumption_is_reported_with_its_certificate(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    broken = note(
        "broken-assumption",
        skill="tidy.wipe",
        certificate="ab" * 32,
        obligations=["closed-loop/clean/progress"],
    )
    log(tmp_path, [broken, note("run-ended", task="tidy.clean", reached=True)])
    assert main(["why", str(tmp_path)]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "tidy.clean: goal reached",
        "  broken    tidy.wipe ended with an undeclared outcome; "
        "1 obligations of certificate abababababab rest on what it does  (record 0)",
    ]


def test_a_step_is_explained_by_its_number(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    fine = [STARTED, note("step-ended", skill="tidy.wipe", outcome="wiped", failed=False, reason="")]
    path = str(log(tmp_path, [*fine, *DENIED, STARTED]))
    assert explained(capsys, path, "--step", "1")["headline"] == "step 1, tidy.wipe, did not fail"
    assert explained(capsys, path, "--step", "2")["chain"][0]["said"] == "step 2, tidy.wipe: denied"
    assert "the log ends before" in explained(capsys, path, "--step", "3")["headline"]
    assert main(["why", path, "--step", "4"]) == 2
    assert "no step 4; the run has 3 steps" in capsys.readouterr().err


def test_a_log_that_was_altered_explains_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = log(tmp_path, DENIED)
    path.write_bytes(path.read_bytes().replace(b"0.41", b"4.10"))
    assert main(["why", str(path)]) == 1
    message = capsys.readouterr()
    assert message.out == ""
    assert "log is not sound" in message.err


def test_without_a_name_it_is_the_newest_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["why"]) == 2
    assert "there is no run in `runs`" in capsys.readouterr().err
    (tmp_path / "runs" / "one").mkdir(parents=True)
    log(tmp_path / "runs" / "one", [FAILED])
    assert main(["why"]) == 0


def test_a_run_that_the_operator_blocks_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["policy", str(BASE / "site.yaml")]) == 0
    for command, what in (("install", str(BASE / "tidy")), ("configure", "tidy"), ("activate", "tidy")):
        assert main([command, what]) == 0
    assert main(["block", "--id", "worn", "--reason", "a finger is worn", "--action", "grip"]) == 0
    assert main(["run", "clean", "--plant", "symbolic", "--out", "runs/blocked"]) == 1
    capsys.readouterr()
    found = explained(capsys)
    (cause,) = found["chain"][-1]["causes"]
    assert (cause["kind"], cause["rule"], cause["code"]) == ("gate", "worn", "AE710")
    assert "a finger is worn" in cause["text"]
