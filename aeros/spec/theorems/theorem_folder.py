"""Folders of theorems in `proofs/`, and the check that their generated files match the code.

The folder of a theorem has `statement.md`, `theorem.py` with a `THEOREM`, the script of each obligation as
`NAME.smt2`, and `expected.json`: verdicts, sizes of unsat cores, Z3's resource units, and the witness that
refutes each mutant. The last two kinds of file are generated, and compared with what is generated now.
"""

from __future__ import annotations

import importlib.util
import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.obligations.verdicts import Verdict
from aeros.spec.text.discovery import shipped_folder
from aeros.spec.theorems.check import Counterexample, MutantResult, TheoremObligationResult
from aeros.spec.theorems.theorem import Theorem

MODULE: Final = "theorem.py"
EXPECTED: Final = "expected.json"


def proofs_folder() -> Path:
    """Return the folder of theorems: `proofs` of the clone, or its copy in a wheel.

    Returns:
        Its path.
    """
    return shipped_folder("proofs")


def theorem_folders(proofs: Path) -> dict[str, Path]:
    """Find the folders of theorems.

    Args:
        proofs: path of `proofs/`.

    Returns:
        The folders by name, sorted.
    """
    return {one.parent.name: one.parent for one in sorted(proofs.glob(f"*/{MODULE}"))}


def load_theorem(folder: Path) -> Theorem:
    """Load the theorem of a folder. Its module may import others of `proofs/`.

    Args:
        folder: folder of the theorem.

    Returns:
        The theorem.

    Raises:
        InternalError: the folder has no `theorem.py`, or that has no `THEOREM`.
    """
    root = str(folder.parents[1])
    if root not in sys.path:
        sys.path.append(root)
    name = f"proofs.{folder.name}.theorem"
    spec = importlib.util.spec_from_file_location(name, folder / MODULE)
    if spec is None or spec.loader is None:
        raise InternalError(f"{folder / MODULE} is not a module")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # where dataclasses look themselves up
    spec.loader.exec_module(module)
    theorem = getattr(module, "THEOREM", None)
    if not isinstance(theorem, Theorem):
        raise InternalError(f"{folder / MODULE} has no `THEOREM`")
    return theorem


@dataclass(frozen=True)
class TheoremResult:
    """The results of a theorem.

    Attributes:
        theorem: the theorem.
        solvers: names and versions of the solvers.
        obligations: results of its obligations.
        mutants: results of its mutants.
        seconds: wall time of the check, s.
    """

    theorem: Theorem
    solvers: tuple[str, ...]
    obligations: tuple[TheoremObligationResult, ...]
    mutants: tuple[MutantResult, ...]
    seconds: float

    @property
    def verdict(self) -> Verdict:
        """PROVED if every obligation is; otherwise the worst verdict of one."""
        found = {one.verdict for one in self.obligations}
        ranked = (Verdict.REFUTED, Verdict.VACUOUS, Verdict.UNKNOWN)
        return next((one for one in ranked if one in found), Verdict.PROVED)

    @property
    def surviving_mutants(self) -> tuple[str, ...]:
        """Mutants that the theorem does not detect."""
        return tuple(one.mutant.name for one in self.mutants if not one.refuted)

    def to_expected_json(self) -> dict[str, Any]:
        """Make the content of `expected.json`.

        Returns:
            JSON values.
        """
        return {
            "theorem": self.theorem.title,
            "solvers": list(self.solvers),
            "obligations": {
                one.name: {"verdict": one.verdict.value, "core": one.unsat_core, "rlimit": one.rlimit_used}
                for one in self.obligations
            },
            "mutants": {one.mutant.name: _refutation(one.checked) for one in self.mutants},
            "seconds": round(self.seconds, 2),
        }


def _refutation(checked: TheoremObligationResult) -> dict[str, Any]:
    found = {"obligation": checked.name, "verdict": checked.verdict.value}
    return found if checked.witness is None else {**found, "witness": witness_to_json(checked.witness)}


def witness_to_json(witness: Counterexample) -> dict[str, Any]:
    """Convert a witness to JSON values.

    Args:
        witness: counterexample.

    Returns:
        The constants, and for each table the answers on the path and its result.
    """
    return {
        "constants": dict(witness.constants),
        "ways": {
            name: [*(f"{question} {str(answer).lower()}" for question, answer in asked), f"result {result}"]
            for name, (asked, result) in witness.paths.items()
        },
    }


def generated_files(outcome: TheoremResult) -> dict[str, str]:
    """Make every generated file of the theorem.

    Args:
        outcome: results of the theorem.

    Returns:
        The texts by file name.
    """
    made = {one.name: one.obligation for one in outcome.obligations if one.obligation is not None}
    texts = {f"{name}.smt2": obligation.to_smtlib() for name, obligation in made.items()}
    return {**texts, EXPECTED: json.dumps(outcome.to_expected_json(), indent=2, ensure_ascii=False) + "\n"}


def stale_files(outcome: TheoremResult, folder: Path) -> list[str]:
    """List the files of the folder that do not match the code; comparable for the same solvers only.

    Args:
        outcome: results of the theorem.
        folder: folder of the theorem.

    Returns:
        The problems in words.
    """
    wanted = generated_files(outcome)
    problems = [f"{name} is no longer generated" for name in _obsolete_files(outcome, folder)]
    for name, text in wanted.items():
        found = _read(folder / name)
        if found is None:
            problems.append(f"{name} is missing")
        elif name == EXPECTED:
            problems += _expected_differences(_parsed(found), outcome)
        elif found != text:
            problems.append(f"{name} does not match the code")
    return problems


def write_generated(outcome: TheoremResult, folder: Path) -> list[str]:
    """Write the generated files that differ in more than the time, and delete obsolete ones.

    Args:
        outcome: results of the theorem.
        folder: folder of the theorem.

    Returns:
        The names of the files that were changed or deleted.
    """
    changed: list[str] = []
    for name, text in generated_files(outcome).items():
        found = _read(folder / name)
        if found is None or _without_time(name, found) != _without_time(name, text):
            (folder / name).write_text(text, encoding="utf-8")
            changed.append(name)
    for name in _obsolete_files(outcome, folder):
        (folder / name).unlink()
        changed.append(name)
    return changed


def _obsolete_files(outcome: TheoremResult, folder: Path) -> list[str]:
    wanted = {f"{one.name}.smt2" for one in outcome.obligations}
    return sorted(path.name for path in folder.glob("*.smt2") if path.name not in wanted)


def _read(path: Path) -> str | None:
    return path.read_text("utf-8") if path.is_file() else None


def _parsed(text: str) -> dict[str, Any]:
    try:
        found = json.loads(text)
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}


def _without_time(name: str, text: str) -> object:
    if name != EXPECTED:
        return text
    return {key: value for key, value in _parsed(text).items() if key != "seconds"}


def _expected_differences(recorded: Mapping[str, Any], outcome: TheoremResult) -> list[str]:
    """List the parts in which `expected.json` differs.

    Core sizes, resource units and witnesses are Z3's, so they are compared only if the same Z3 was asked;
    time is never compared.
    """
    current = outcome.to_expected_json()
    if not _z3_only(outcome.solvers) or _z3_only(recorded.get("solvers", ())) != _z3_only(outcome.solvers):
        recorded, current = _verdicts_alone(recorded), _verdicts_alone(current)
    return [
        f"{EXPECTED} differs in the {part}"
        for part in ("theorem", "obligations", "mutants")
        if recorded.get(part) != current[part]
    ]


def _z3_only(solvers: Sequence[str]) -> list[str]:
    return [one for one in solvers if one.startswith("z3 ")]


def _verdicts_alone(expected: Mapping[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = {"theorem": expected.get("theorem")}
    for part in ("obligations", "mutants"):
        found[part] = {name: one.get("verdict") for name, one in expected.get(part, {}).items()}
    return found
