"""`aeros prove` over a folder of small theorems; those of the repository are in tests/repo."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit

_THEOREM = """
from types import SimpleNamespace

from aeros.spec.theorems.symbolic_execution import SymbolicValue, execute_symbolically
from aeros.spec.theorems.module_copies import Mutant
from aeros.spec.theorems.theorem import SymbolicFunction, Theorem, TheoremObligation


def risk(code):
    layers = code.module("aeros.runtime.gate.finite_layers")

    def run(ask):
        kind, skill = (
            SimpleNamespace(name="n", id="n", risk=SymbolicValue(one, ask)) for one in ("kind", "skill")
        )
        site = SimpleNamespace(risk_ceiling=SymbolicValue("site", ask))
        return str(not list(layers._risk_objections(site, skill, kind))).lower()

    return TheoremObligation(
        "No objection exactly where the risk is borne.",
        [f"(declare-const {one} Int)" for one in ("kind", "skill", "site")],
        "CONCLUSION",
        tables=(SymbolicFunction("nothing", "Bool", execute_symbolically(run)),),
        assumptions={"some": "ASSUMPTION"},
    )


THEOREM = Theorem(
    "no action carries too much risk",
    {"risk": risk},
    (
        Mutant(
            "bears-any-risk",
            "risk",
            "aeros.runtime.gate.finite_layers",
            "skill.risk > site.risk_ceiling",
            "BROKEN",
        ),
    ),
)
"""
_RIGHT = {
    "CONCLUSION": "(= nothing (and (<= kind skill) (<= skill site)))",
    "ASSUMPTION": "(<= 0 kind)",
    "BROKEN": "False",
}


@pytest.fixture
def proofs(tmp_path: Path) -> Callable[..., Path]:
    """Makes a folder of one theorem, in which some words are others than they should be."""

    def make(**other: str) -> Path:
        text = _THEOREM
        for word, right in _RIGHT.items():
            text = text.replace(word, other.get(word, right))
        folder = tmp_path / "proofs" / "risk"
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "theorem.py").write_text(text, encoding="utf-8")
        return folder

    return make


def _prove(folder: Path, *arguments: str) -> int:
    return main(["prove", "--proofs", str(folder.parent), *arguments])


def _report(folder: Path, capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, Any]:
    capsys.readouterr()
    status = _prove(folder, "--format", "json", *arguments)
    (found,) = json.loads(capsys.readouterr().out)["theorems"]
    return status, found


def test_a_theorem_is_proved_once_what_is_generated_is_there(
    proofs: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    folder = proofs()
    status, found = _report(folder, capsys)
    assert (status, found["problems"]) == (
        Exit.REJECTED,
        ["risk.smt2 is missing", "expected.json is missing"],
    )
    assert _prove(folder, "--update") == Exit.SUCCESS
    for solver in ("both", "z3", "cvc5"):
        status, found = _report(folder, capsys, "--solver", solver)
        assert (status, found["verdict"], found["problems"]) == (Exit.SUCCESS, "PROVED", [])
    expected = json.loads((folder / "expected.json").read_text("utf-8"))
    assert [one.split()[0] for one in expected["solvers"]] == ["z3", "cvc5"]
    assert expected["obligations"]["risk"]["verdict"] == "PROVED"
    way = expected["mutants"]["bears-any-risk"]["witness"]["ways"]["nothing"]
    assert way == ["(< skill kind) false", "result true"]


def test_several_at_a_time_say_what_each_says_by_itself(
    proofs: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    folder = proofs()
    _prove(folder, "--update")
    shutil.copytree(folder, folder.parent / "wrong")
    (folder.parent / "wrong" / "risk.smt2").write_text("", encoding="utf-8")
    capsys.readouterr()
    message = []
    for jobs in ("1", "2"):
        assert _prove(folder, "--jobs", jobs) == Exit.REJECTED
        message.append(capsys.readouterr().out)
    assert message[0] == message[1]
    assert [line.split()[:2] for line in message[0].splitlines() if line[0] != " "] == [
        ["risk", "proved"],
        ["wrong", "failed"],
    ]


def test_an_update_that_changes_nothing_but_the_time_writes_nothing(
    proofs: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    folder = proofs()
    _prove(folder, "--update")
    _, found = _report(folder, capsys, "--update")
    assert found["rewritten"] == []
    (folder / "gone.smt2").write_text("", encoding="utf-8")
    assert _report(folder, capsys)[1]["problems"] == ["gone.smt2 is no longer generated"]
    assert _report(folder, capsys, "--update")[1]["rewritten"] == ["gone.smt2"]


@pytest.mark.parametrize(
    ("wrong", "verdict", "message"),
    [
        ({"CONCLUSION": "(= nothing (<= kind skill))"}, "REFUTED", "obligation risk is REFUTED"),
        ({"ASSUMPTION": "(< kind kind)"}, "VACUOUS", "obligation risk is VACUOUS"),
        (
            {"BROKEN": "skill.risk >= site.risk_ceiling + 1"},
            "PROVED",
            "the theorem also holds for the mutant bears-any-risk",
        ),
    ],
)
def test_a_name_that_is_no_theorem_fails(
    proofs: Callable[..., Path],
    capsys: pytest.CaptureFixture[str],
    wrong: dict[str, str],
    verdict: str,
    message: str,
) -> None:
    status, found = _report(proofs(**wrong), capsys, "--update")
    assert (status, found["verdict"]) == (Exit.REJECTED, verdict)
    assert any(problem.startswith(message) for problem in found["problems"])


def test_a_refutation_shows_the_way_that_the_code_goes(
    proofs: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    _prove(proofs(CONCLUSION="(= nothing (<= kind skill))"), "--update")
    assert "nothing: (< skill kind) false; (< site skill) true; result false" in capsys.readouterr().out


def test_a_question_that_no_solver_decides_is_undecided(
    proofs: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    powers = "(not (= (+ (* kind kind kind) (* skill skill skill)) (+ 33 (* site site site))))"
    folder = proofs(CONCLUSION=powers, ASSUMPTION="(and (< 1000 kind) (< 1000 skill) (< 1000 site))")
    status, found = _report(folder, capsys, "--solver", "cvc5")
    assert (status, found["verdict"]) == (Exit.UNDECIDED, "UNKNOWN")


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("risk.smt2", lambda text: text.replace("nothing.0", "something")),
        ("expected.json", lambda text: text.replace('"core": ', '"core": 1')),
        ("expected.json", lambda text: text.replace('"PROVED"', '"REFUTED"')),
        ("expected.json", lambda text: text.replace("(< skill kind) false", "(< skill kind) true")),
        ("expected.json", lambda _: "no JSON"),
    ],
)
def test_a_generated_file_that_says_otherwise_fails(
    proofs: Callable[..., Path],
    capsys: pytest.CaptureFixture[str],
    name: str,
    change: Callable[[str], str],
) -> None:
    folder = proofs()
    _prove(folder, "--update")
    text = (folder / name).read_text("utf-8")
    assert change(text) != text
    (folder / name).write_text(change(text), encoding="utf-8")
    status, found = _report(folder, capsys)
    assert status == Exit.REJECTED
    assert found["problems"]
    assert all(problem.startswith(name) for problem in found["problems"])


def test_verdicts_of_another_version_of_z3_are_compared_but_its_costs_are_not(
    proofs: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    folder = proofs()
    _prove(folder, "--update")
    path = folder / "expected.json"
    older = path.read_text("utf-8").replace('"z3 ', '"z3 0.').replace('"core": ', '"core": 1')
    path.write_text(older, encoding="utf-8")
    assert _report(folder, capsys)[1]["problems"] == []
    path.write_text(older.replace('"PROVED"', '"REFUTED"'), encoding="utf-8")
    assert _report(folder, capsys)[1]["problems"] == ["expected.json differs in the obligations"]


def test_contradictory_options_are_a_usage_error(
    proofs: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = proofs()
    assert _prove(folder, "hazard") == Exit.USAGE
    assert "there is no theorem `hazard`; there are risk" in capsys.readouterr().err
    assert _prove(folder, "--update", "--solver", "z3") == Exit.USAGE
    shutil.rmtree(folder)
    assert _prove(folder) == Exit.USAGE
    assert "there are no theorems in" in capsys.readouterr().err
