"""Folders of theorems, and whether what was generated is what the code says."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.obligations.verdicts import Verdict
from aeros.spec.theorems.check import Counterexample, MutantResult, TheoremObligationResult
from aeros.spec.theorems.module_copies import Mutant
from aeros.spec.theorems.theorem import Theorem, TheoremObligation
from aeros.spec.theorems.theorem_folder import (
    TheoremResult,
    generated_files,
    load_theorem,
    proofs_folder,
    stale_files,
    theorem_folders,
    witness_to_json,
    write_generated,
)

CLAIM = TheoremObligation("It holds.", [], "true")
WITNESS = Counterexample({"x": "7"}, {"small": ([("(< x 3)", False), ("(< x 5)", True)], "false")})
MUTANT = Mutant("broken", "it", "aeros.it", "a", "b")


def result(name: str, verdict: Verdict, witness: Counterexample | None = None) -> TheoremObligationResult:
    return TheoremObligationResult(name, CLAIM, {"z3": verdict}, 2, 345, witness)


OUTCOME = TheoremResult(
    Theorem("It is so.", {}, ()),
    ("z3 4.8",),
    (result("it", Verdict.PROVED), result("other", Verdict.PROVED)),
    (MutantResult(MUTANT, result("it", Verdict.REFUTED, WITNESS)),),
    1.2345,
)
EXPECTED = {
    "theorem": "It is so.",
    "solvers": ["z3 4.8"],
    "obligations": {
        "it": {"verdict": "PROVED", "core": 2, "rlimit": 345},
        "other": {"verdict": "PROVED", "core": 2, "rlimit": 345},
    },
    "mutants": {
        "broken": {
            "obligation": "it",
            "verdict": "REFUTED",
            "witness": {
                "constants": {"x": "7"},
                "ways": {"small": ["(< x 3) false", "(< x 5) true", "result false"]},
            },
        }
    },
    "seconds": 1.23,
}


def test_the_theorems_of_this_repository_are_found_sorted() -> None:
    found = theorem_folders(proofs_folder())
    assert list(found) == sorted(found)
    assert found["audit_chain"] == proofs_folder() / "audit_chain"
    assert "lib" not in found


@pytest.fixture
def proofs(tmp_path: Path) -> Iterator[Path]:
    before = list(sys.path)
    (tmp_path / "proofs" / "made_up").mkdir(parents=True)
    yield tmp_path / "proofs"
    sys.path[:] = before
    sys.modules.pop("proofs.made_up.theorem", None)


def test_a_theorem_is_loaded_from_its_folder(proofs: Path) -> None:
    folder = proofs / "made_up"
    (folder / "theorem.py").write_text(
        "from aeros.spec.theorems.theorem import Theorem\nTHEOREM = Theorem('Made up.', {}, ())\n"
    )
    assert theorem_folders(proofs) == {"made_up": folder}
    assert load_theorem(folder).title == "Made up."
    assert sys.path.count(str(proofs.parent)) == 1
    load_theorem(folder)
    assert sys.path.count(str(proofs.parent)) == 1


def test_a_folder_without_a_theorem_is_an_error(proofs: Path) -> None:
    for text in ("", "THEOREM = 'It is so.'\n"):
        (proofs / "made_up" / "theorem.py").write_text(text)
        with pytest.raises(InternalError, match="has no `THEOREM`"):
            load_theorem(proofs / "made_up")


def test_the_verdict_is_the_worst_and_mutants_that_pass_survive() -> None:
    assert (OUTCOME.verdict, OUTCOME.surviving_mutants) == (Verdict.PROVED, ())
    for worst in (Verdict.UNKNOWN, Verdict.VACUOUS, Verdict.REFUTED):
        assert replace(OUTCOME, obligations=(*OUTCOME.obligations, result("x", worst))).verdict is worst
    both = (result("x", Verdict.UNKNOWN), result("y", Verdict.REFUTED))
    assert replace(OUTCOME, obligations=both).verdict is Verdict.REFUTED
    alive = MutantResult(MUTANT, result("it", Verdict.UNKNOWN))
    assert replace(OUTCOME, mutants=(*OUTCOME.mutants, alive)).surviving_mutants == ("broken",)


def test_results_and_witnesses_are_written_as_json() -> None:
    assert OUTCOME.to_expected_json() == EXPECTED
    assert witness_to_json(WITNESS) == EXPECTED["mutants"]["broken"]["witness"]  # type: ignore[index]
    without = replace(OUTCOME, mutants=(MutantResult(MUTANT, result("it", Verdict.UNKNOWN)),))
    assert without.to_expected_json()["mutants"] == {"broken": {"obligation": "it", "verdict": "UNKNOWN"}}


def test_there_is_a_file_for_each_obligation_and_one_for_the_results() -> None:
    files = generated_files(OUTCOME)
    assert list(files) == ["it.smt2", "other.smt2", "expected.json"]
    assert files["it.smt2"] == CLAIM.to_smtlib()
    assert json.loads(files["expected.json"]) == EXPECTED
    assert files["expected.json"].endswith("}\n")


def test_a_freshly_written_file_is_not_stale_and_is_not_written_again(tmp_path: Path) -> None:
    assert write_generated(OUTCOME, tmp_path) == ["it.smt2", "other.smt2", "expected.json"]
    assert stale_files(OUTCOME, tmp_path) == []
    slower = replace(OUTCOME, seconds=99.0)
    assert stale_files(slower, tmp_path) == write_generated(slower, tmp_path) == []
    assert json.loads((tmp_path / "expected.json").read_text())["seconds"] == 1.23


def test_missing_changed_and_surplus_files_are_stale_and_are_renewed(tmp_path: Path) -> None:
    write_generated(OUTCOME, tmp_path)
    (tmp_path / "it.smt2").write_text("(check-sat)\n")
    (tmp_path / "other.smt2").unlink()
    (tmp_path / "old.smt2").write_text("")
    (tmp_path / "notes.md").write_text("")
    assert stale_files(OUTCOME, tmp_path) == [
        "old.smt2 is no longer generated",
        "it.smt2 does not match the code",
        "other.smt2 is missing",
    ]
    assert write_generated(OUTCOME, tmp_path) == ["it.smt2", "other.smt2", "old.smt2"]
    assert stale_files(OUTCOME, tmp_path) == []
    assert {one.name for one in tmp_path.iterdir()} == {"it.smt2", "other.smt2", "expected.json", "notes.md"}


@pytest.mark.parametrize("text", ["", "[]", "{"])
def test_results_that_cannot_be_read_differ_in_every_part(text: str, tmp_path: Path) -> None:
    write_generated(OUTCOME, tmp_path)
    (tmp_path / "expected.json").write_text(text)
    parts = ("theorem", "obligations", "mutants")
    assert stale_files(OUTCOME, tmp_path) == [f"expected.json differs in the {part}" for part in parts]
    assert write_generated(OUTCOME, tmp_path) == ["expected.json"]


def test_units_and_witnesses_are_compared_for_the_same_z3_alone(tmp_path: Path) -> None:
    write_generated(OUTCOME, tmp_path)
    it, other = OUTCOME.obligations
    cheaper = replace(OUTCOME, obligations=(replace(it, rlimit_used=1), other))
    assert stale_files(cheaper, tmp_path) == ["expected.json differs in the obligations"]
    for solvers in (("z3 4.9",), ("cvc5 1.0",), ()):
        assert stale_files(replace(cheaper, solvers=solvers), tmp_path) == []
    assert stale_files(replace(cheaper, solvers=("z3 4.8", "cvc5 1.0")), tmp_path) != []
    undecided = replace(cheaper, solvers=("z3 4.9",), obligations=(result("it", Verdict.UNKNOWN), other))
    assert stale_files(undecided, tmp_path) == ["expected.json differs in the obligations"]
    survives = replace(
        cheaper, solvers=("cvc5 1.0",), mutants=(MutantResult(MUTANT, result("it", Verdict.PROVED)),)
    )
    assert stale_files(survives, tmp_path) == ["expected.json differs in the mutants"]
