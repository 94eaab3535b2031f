"""A theorem + solvers → what became of it; each mutant has to refute an obligation, with a witness."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from aeros.spec.backends.solver_results import Answer, Result, TextAnswer
from aeros.spec.diagnostics.errors import DisagreementError, InternalError
from aeros.spec.obligations.verdicts import Verdict
from aeros.spec.theorems.module_copies import Code, Mutant
from aeros.spec.theorems.symbolic_execution import way_through
from aeros.spec.theorems.theorem import Obligation, Theorem

RLIMIT = 20_000_000
"""z3 resource units for one question; no theorem needs a tenth."""


class SecondSolver(Protocol):
    """As `agreement.SecondSolver`: answers an SMT-LIB script that asks once."""

    @property
    def name(self) -> str: ...  # noqa: D102

    def answer(self, script: str) -> Answer: ...  # noqa: D102


@dataclass(frozen=True)
class Witness:
    """An input on which an obligation fails.

    constants: the values of what is declared.
    ways: by table, what the code asks on that input, with the answers, and what then comes of it.
    """

    constants: Mapping[str, str]
    ways: Mapping[str, tuple[Sequence[tuple[str, bool]], str]]


@dataclass(frozen=True)
class Checked:
    """What became of the obligation `name`.

    verdicts: by solver; REFUTED without a witness where only the second solver said so.
    core, spent: z3's: assertions that are enough, and resource units; 0 where it was not asked.
    """

    name: str
    obligation: Obligation
    verdicts: Mapping[str, Verdict]
    core: int = 0
    spent: int = 0
    witness: Witness | None = None
    reason: str = ""

    @property
    def verdict(self) -> Verdict:
        """REFUTED where one says so; PROVED where all do."""
        ranked = (Verdict.REFUTED, Verdict.VACUOUS, Verdict.UNKNOWN)
        return next((one for one in ranked if one in self.verdicts.values()), Verdict.PROVED)


@dataclass(frozen=True)
class CheckedMutant:
    """What became of the obligation that a mutant must refute; it fails where that is not refuted."""

    mutant: Mutant
    checked: Checked

    @property
    def refuted(self) -> bool:
        """Whether the theorem could tell it from the code that ships."""
        return self.checked.verdict is Verdict.REFUTED


class Solvers:
    """The solvers that are to agree: Z3, a second one, or both."""

    def __init__(self, *, z3: bool = True, second: SecondSolver | None = None) -> None:
        self._z3 = z3
        self._second = second

    @property
    def names(self) -> tuple[str, ...]:
        """Each with its version."""
        from aeros.spec.backends.z3_solver import solver_version

        return (*([solver_version()] if self._z3 else []), *([self._second.name] if self._second else []))

    def check(self, name: str, obligation: Obligation) -> Checked:
        """What becomes of `obligation`; VACUOUS where its assumptions exclude every input."""
        script = obligation.script()
        verdicts: dict[str, Verdict] = {}
        found = TextAnswer(Result.UNKNOWN, {}, 0, 0)
        reasons: list[str] = []
        if self._z3:
            found = _answer_of_z3(script)
            verdicts["z3"] = _VERDICTS[found.result]
            reasons += [f"z3: {found.reason}"] if found.reason else []
        if self._second is not None:
            said = self._second.answer(script)
            verdicts[self._second.name.partition(" ")[0]] = _VERDICTS[said.result]
            reasons += [f"{self._second.name}: {said.reason}"] if said.reason else []
        decided = {name: one for name, one in verdicts.items() if one is not Verdict.UNKNOWN}
        if len(set(decided.values())) > 1:
            first, second = (f"{name} says {one.value}" for name, one in decided.items())
            raise DisagreementError(name, script, first, second)
        witness = _witness(name, obligation) if found.result is Result.SAT else None
        if Verdict.PROVED in decided.values():
            holding = self._premises(obligation)
            if holding is not Result.SAT:
                verdicts = dict.fromkeys(verdicts, _OF_PREMISES[holding])
        return Checked(name, obligation, verdicts, found.core, found.spent, witness, "; ".join(reasons))

    def _premises(self, obligation: Obligation) -> Result:
        """Whether the assumptions can hold, by the first solver that is asked."""
        if self._z3 or self._second is None:
            return _answer_of_z3(obligation.premises()).result
        return self._second.answer(obligation.premises()).result


_VERDICTS: Mapping[Result, Verdict] = {
    Result.SAT: Verdict.REFUTED,
    Result.UNSAT: Verdict.PROVED,
    Result.UNKNOWN: Verdict.UNKNOWN,
}


_OF_PREMISES: Mapping[Result, Verdict] = {Result.UNSAT: Verdict.VACUOUS, Result.UNKNOWN: Verdict.UNKNOWN}


def _answer_of_z3(script: str) -> TextAnswer:
    # z3 takes 80 ms to import, which whoever asks another solver need not pay.
    from aeros.spec.backends.z3_solver import answer_text

    return answer_text(script, RLIMIT)


def _witness(name: str, obligation: Obligation) -> Witness:
    script, by_constant = obligation.watched()
    answer = _answer_of_z3(script)
    if answer.result is not Result.SAT:
        raise InternalError(f"the witness against `{name}` is not found again: {answer.reason}")
    model = dict(answer.model)
    answers = {question: model.pop(constant, "") == "true" for constant, question in by_constant.items()}
    ways = {table.name: way_through(table.diagram, answers) for table in obligation.tables}
    return Witness(dict(sorted(model.items())), ways)


def check_theorem(
    theorem: Theorem, shipped: Code, solvers: Solvers, progress: Callable[[str], None]
) -> list[Checked]:
    """What becomes of each obligation, made of the code that ships."""
    checked: list[Checked] = []
    for name, make in theorem.obligations.items():
        progress(name)
        checked.append(solvers.check(name, make(shipped)))
    return checked


def check_mutants(theorem: Theorem, solvers: Solvers, progress: Callable[[str], None]) -> list[CheckedMutant]:
    """What becomes of the obligation that each mutant must refute, made of the mutant."""
    checked: list[CheckedMutant] = []
    for mutant in theorem.mutants:
        progress(mutant.name)
        code = Code(mutant)
        obligation = theorem.obligations[mutant.refutes](code)
        if mutant.module not in code.loaded:
            raise InternalError(
                f"`{mutant.refutes}` is not made of `{mutant.module}`, which `{mutant.name}` breaks"
            )
        checked.append(CheckedMutant(mutant, solvers.check(mutant.refutes, obligation)))
    return checked
