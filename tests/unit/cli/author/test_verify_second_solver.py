from __future__ import annotations

import json
import re
import shutil
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.spec.backends import cvc5_solver, smtlib
from aeros.spec.backends.cvc5_solver import Cvc5
from aeros.spec.backends.solver_process import SolverProcess
from aeros.spec.backends.solver_results import SatResult, SolverAnswer
from aeros.spec.expr import terms as t
from aeros.spec.verification.certificate import LOCK

CORPUS = Path(__file__).parents[3] / "corpus"
SITE = str(CORPUS / "site" / "table.yaml")
_honest = Cvc5.solve_script
_OPPOSITE = {SatResult.SAT: SatResult.UNSAT, SatResult.UNSAT: SatResult.SAT}


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in ("cache", "tmp"):
        (tmp_path / name).mkdir()
    monkeypatch.setenv("AEROS_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "tmp"))
    return Path(shutil.copytree(CORPUS / "accepted" / "left_to_the_gate", tmp_path / "left_to_the_gate"))


def verify(*arguments: object) -> int:
    return main(["verify", *map(str, arguments), "--site", SITE, "--second-solver", "cvc5"])


def _lies_of(monkeypatch: pytest.MonkeyPatch, truth: SatResult) -> None:
    """A cvc5 that says the opposite wherever `truth` is the answer."""

    def solve_script(self: Cvc5, script: str) -> SolverAnswer:
        message = _honest(self, script)
        return SolverAnswer(_OPPOSITE[message.result], {}) if message.result is truth else message

    monkeypatch.setattr(Cvc5, "solve_script", solve_script)


@pytest.mark.parametrize("truth", [SatResult.SAT, SatResult.UNSAT])
def test_a_second_solver_that_lies_ends_the_run_and_nothing_is_written(
    truth: SatResult, module: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    _lies_of(monkeypatch, truth)
    before = sorted(module.iterdir())
    output = module.parent / "report.json"
    assert verify(module, "--format", "json", "--output", output) == Exit.INTERNAL_ERROR
    shown = capsys.readouterr()
    assert shown.out == ""
    assert "two answers about policy/" in shown.err
    assert re.search(rf"^  (z3 [\d.]+|AEROS, by bounds alone,) says {truth.value}$", shown.err, re.MULTILINE)
    assert re.search(rf"^  cvc5 [\d.]+ says {_OPPOSITE[truth].value}$", shown.err, re.MULTILINE)
    assert "Please report it" in shown.err
    assert sorted(module.iterdir()) == before
    assert not output.exists()
    kept = Path(shown.err.split()[-1])
    assert _honest(Cvc5(), kept.read_text()).result is truth


def test_kept_answers_are_examined_too(
    module: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["verify", str(module), "--site", SITE]) == Exit.SUCCESS
    lock = (module / LOCK).read_bytes()

    _lies_of(monkeypatch, SatResult.SAT)
    monkeypatch.setattr(SolverProcess, "check_sat", None)  # Z3 is not asked again
    assert verify(module) == Exit.INTERNAL_ERROR
    assert f"about policy/wait/satisfiable ({SITE}) differ:" in capsys.readouterr().err
    assert (module / LOCK).read_bytes() == lock


def test_a_question_that_no_file_can_take_is_shown(
    module: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    _lies_of(monkeypatch, SatResult.SAT)
    monkeypatch.setattr("tempfile.tempdir", str(module / "not_there"))
    assert verify(module) == Exit.INTERNAL_ERROR
    shown = capsys.readouterr().err
    assert "could not be written to a file" in shown
    assert "(check-sat)" in shown


def test_agreement_is_reported_and_changes_no_certificate(
    module: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["verify", str(module), "--site", SITE]) == Exit.SUCCESS
    without = (module / LOCK).read_bytes()
    (module / LOCK).unlink()
    capsys.readouterr()
    assert verify(module) == Exit.SUCCESS
    assert re.search(r"^cvc5 [\d.]+ agreed on (\d+) of \1 questions$", capsys.readouterr().out, re.MULTILINE)
    assert (module / LOCK).read_bytes() == without


def test_questions_beyond_the_second_solver_are_reported_and_the_answer_of_z3_stands(
    module: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    unknown = SolverAnswer(SatResult.UNKNOWN, {}, "out of its depth")
    monkeypatch.setattr(Cvc5, "solve_script", lambda *_: unknown)
    assert verify(module) == Exit.SUCCESS
    shown = capsys.readouterr().out
    assert re.search(r"agreed on 0 of (\d+) questions; \1 undecided by it \(Z3's verdict used\)", shown)
    assert re.search(r"^  safety/.*/slow-near-person \(.*ecm.yaml\): out of its depth$", shown, re.MULTILINE)
    assert (module / LOCK).exists()
    assert verify(module, "--format", "json") == Exit.SUCCESS
    reported = json.loads(capsys.readouterr().out)["second_solver"]
    assert reported["agreed"] == 0
    assert len(reported["undecided"]) == reported["questions"] > 50


def test_strict_compares_how_questions_are_written_too(
    module: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["verify", str(module), "--site", SITE, "--strict"]) == Exit.SUCCESS
    shown = capsys.readouterr().out
    assert re.search(r"^cvc5 [\d.]+ agreed on (\d+) of \1 questions$", shown, re.MULTILINE)
    assert re.search(r"^both encodings of \d+ questions agree with the definition", shown, re.MULTILINE)
    assert main(["verify", str(module), "--site", SITE, "--strict", "--format", "json"]) == Exit.SUCCESS
    compared = json.loads(capsys.readouterr().out)["encodings"]
    assert compared["unread"] == []
    assert compared["truths"] > 20 * compared["questions"] > 1000


def test_strict_takes_nothing_on_trust_that_one_solver_alone_decided(
    module: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    unknown = SolverAnswer(SatResult.UNKNOWN, {}, "out of its depth")
    monkeypatch.setattr(Cvc5, "solve_script", lambda *_: unknown)
    assert main(["verify", str(module), "--site", SITE, "--strict"]) == Exit.UNDECIDED
    assert "undecided by it" in capsys.readouterr().out


def test_strict_ends_the_run_where_a_question_is_written_wrongly(
    module: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    right = smtlib._Script._scalar

    def wrong(self: smtlib._Script, term: t.Term) -> str:
        return right(self, replace(term, kind="max") if isinstance(term, t.Extremum) else term)

    monkeypatch.setattr(smtlib._Script, "_scalar", wrong)
    assert main(["verify", str(module), "--site", SITE, "--strict"]) == Exit.INTERNAL_ERROR
    assert "differ:" in capsys.readouterr().err


def test_strict_without_cvc5_names_the_cure(
    module: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delitem(sys.modules, cvc5_solver.__name__)
    monkeypatch.setitem(sys.modules, "cvc5", None)
    assert main(["verify", str(module), "--site", SITE, "--strict"]) == Exit.USAGE
    assert "pip install '.[cvc5]'" in capsys.readouterr().err


def test_without_cvc5_the_cure_is_named(
    module: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delitem(sys.modules, cvc5_solver.__name__)
    monkeypatch.setitem(sys.modules, "cvc5", None)
    with pytest.raises(SystemExit) as ended:
        verify(module)
    assert ended.value.code == Exit.USAGE
    assert "pip install '.[cvc5]'" in capsys.readouterr().err


def test_a_solver_of_another_name_is_a_usage_error(module: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["verify", str(module), "--second-solver", "yices"])
    assert ended.value.code == Exit.USAGE
    assert "expected `cvc5`" in capsys.readouterr().err
