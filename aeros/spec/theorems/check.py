"""Check of a theorem by solvers: each obligation, and each mutant, which must refute one with a witness."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from aeros.spec.backends.solver_process import SOLVER_PROCESS
from aeros.spec.backends.solver_results import SatResult, ScriptAnswer, SecondSolver
from aeros.spec.diagnostics.errors import DisagreementError, InternalError
from aeros.spec.obligations.verdicts import Verdict
from aeros.spec.theorems.module_copies import ModuleSource, Mutant
from aeros.spec.theorems.symbolic_execution import path_for_answers
from aeros.spec.theorems.theorem import Theorem, TheoremObligation

RLIMIT = 20_000_000
"""z3 resource units for one question; no theorem needs a tenth."""

_QUESTION_SECONDS = 60.0
"""Time limit of one question, s; no question of a theorem takes longer than a second."""


@dataclass(frozen=True)
class Counterexample:
    """An input on which an obligation fails.

    Attributes:
        constants: values of the declared constants.
        paths: by table, the questions that the code asks on that input with the answers, and the result.
    """

    constants: Mapping[str, str]
    paths: Mapping[str, tuple[Sequence[tuple[str, bool]], str]]


@dataclass(frozen=True)
class TheoremObligationResult:
    """The result of one obligation.

    Attributes:
        name: name of the obligation.
        obligation: the obligation; None if it could not be made from the code.
        verdicts: verdict by solver; REFUTED without a witness if only the second solver refutes it.
        unsat_core: size of Z3's unsat core, in assertions; 0 if Z3 was not asked.
        rlimit_used: Z3 resource units; 0 if Z3 was not asked.
        witness: counterexample that Z3 found.
        reason: reasons of solvers that gave up.
    """

    name: str
    obligation: TheoremObligation | None
    verdicts: Mapping[str, Verdict]
    unsat_core: int = 0
    rlimit_used: int = 0
    witness: Counterexample | None = None
    reason: str = ""

    @property
    def verdict(self) -> Verdict:
        """REFUTED if a solver refutes it; PROVED if all prove it; UNKNOWN if it could not be made."""
        if self.obligation is None:
            return Verdict.UNKNOWN
        ranked = (Verdict.REFUTED, Verdict.VACUOUS, Verdict.UNKNOWN)
        return next((one for one in ranked if one in self.verdicts.values()), Verdict.PROVED)


@dataclass(frozen=True)
class MutantResult:
    """Result of a mutant, which survives if its obligation is not refuted.

    Attributes:
        mutant: the mutant.
        checked: result of the obligation that it must refute.
    """

    mutant: Mutant
    checked: TheoremObligationResult

    @property
    def refuted(self) -> bool:
        """True if the theorem distinguishes the mutant from the code that ships."""
        return self.checked.verdict is Verdict.REFUTED


class SolverPanel:
    """Solvers that must agree: Z3, a second one, or both."""

    def __init__(self, *, z3: bool = True, second: SecondSolver | None = None) -> None:
        self._z3 = z3
        self._second = second

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the solvers with their versions."""
        from aeros.spec.backends.z3_solver import solver_version

        return (*([solver_version()] if self._z3 else []), *([self._second.name] if self._second else []))

    def check(
        self, name: str, obligation: TheoremObligation, *, is_expected: bool = True
    ) -> TheoremObligationResult:
        """Check an obligation with every solver.

        Args:
            name: name of the obligation.
            obligation: the obligation.
            is_expected: it should be proved; if it should be refuted, Z3 is asked for the witness at once,
                and unsat core and resource units are those of that question.

        Returns:
            The verdicts; VACUOUS if its assumptions exclude every input.

        Raises:
            DisagreementError: one solver proves it and another refutes it.
        """
        script = obligation.to_smtlib()
        verdicts: dict[str, Verdict] = {}
        found = ScriptAnswer(SatResult.UNKNOWN, {}, 0, 0)
        reasons: list[str] = []
        if self._z3:
            found = _solve_with_z3(script if is_expected else obligation.to_traced_smtlib()[0])
            verdicts["z3"] = _VERDICTS[found.result]
            reasons += [f"z3: {found.reason}"] if found.reason else []
        if self._second is not None:
            answer = self._second.solve_script(script)
            verdicts[self._second.name.partition(" ")[0]] = _VERDICTS[answer.result]
            reasons += [f"{self._second.name}: {answer.reason}"] if answer.reason else []
        decided = {name: one for name, one in verdicts.items() if one is not Verdict.UNKNOWN}
        if len(set(decided.values())) > 1:
            first, second = (f"{name} says {one.value}" for name, one in decided.items())
            raise DisagreementError(name, script, first, second)
        witness = None
        if found.result is SatResult.SAT:
            witness = _witness(name, obligation, _trace(obligation) if is_expected else found)
        if Verdict.PROVED in decided.values():
            holding = self._check_premises(obligation)
            if holding is not SatResult.SAT:
                verdicts = dict.fromkeys(verdicts, _PREMISE_VERDICTS[holding])
        return TheoremObligationResult(
            name, obligation, verdicts, found.unsat_core, found.rlimit_used, witness, "; ".join(reasons)
        )

    def _check_premises(self, obligation: TheoremObligation) -> SatResult:
        """Decide with one solver if the assumptions are satisfiable."""
        if self._z3 or self._second is None:
            return _solve_with_z3(obligation.premises_to_smtlib()).result
        return self._second.solve_script(obligation.premises_to_smtlib()).result


_VERDICTS: Mapping[SatResult, Verdict] = {
    SatResult.SAT: Verdict.REFUTED,
    SatResult.UNSAT: Verdict.PROVED,
    SatResult.UNKNOWN: Verdict.UNKNOWN,
}


_PREMISE_VERDICTS: Mapping[SatResult, Verdict] = {
    SatResult.UNSAT: Verdict.VACUOUS,
    SatResult.UNKNOWN: Verdict.UNKNOWN,
}


def _solve_with_z3(script: str) -> ScriptAnswer:
    return SOLVER_PROCESS.solve_script(script, RLIMIT, _QUESTION_SECONDS)


def _trace(obligation: TheoremObligation) -> ScriptAnswer:
    return _solve_with_z3(obligation.to_traced_smtlib()[0])


def _witness(name: str, obligation: TheoremObligation, traced: ScriptAnswer) -> Counterexample:
    """Make the witness of the answer to the traced script.

    Raises:
        InternalError: the answer is another than that to the plain script.
    """
    if traced.result is not SatResult.SAT:
        raise InternalError(f"the witness against `{name}` is not found again: {traced.reason}")
    _, by_constant = obligation.to_traced_smtlib()
    model = dict(traced.model)
    answers = {question: model.pop(constant, "") == "true" for constant, question in by_constant.items()}
    ways = {table.name: path_for_answers(table.diagram, answers) for table in obligation.tables}
    return Counterexample(dict(sorted(model.items())), ways)


def check_theorem(
    theorem: Theorem, shipped: ModuleSource, solvers: SolverPanel, progress: Callable[[str], None]
) -> list[TheoremObligationResult]:
    """Check each obligation of a theorem, made from the code that ships.

    Args:
        theorem: the theorem.
        shipped: source of the modules that ship.
        solvers: solvers to ask.
        progress: called with the name of each obligation before it is checked.

    Returns:
        The results in the order of the obligations.
    """
    checked: list[TheoremObligationResult] = []
    for name, make in theorem.obligations.items():
        progress(name)
        checked.append(_check_made(name, make, shipped, solvers, is_expected=True))
    return checked


def _check_made(
    name: str,
    make: Callable[[ModuleSource], TheoremObligation],
    code: ModuleSource,
    solvers: SolverPanel,
    *,
    is_expected: bool,
) -> TheoremObligationResult:
    """Make an obligation and check it; code that it cannot be made of leaves it UNKNOWN, with the reason.

    Raises:
        DisagreementError: one solver proves it and another refutes it.
    """
    try:
        obligation = make(code)
    except Exception as error:  # changed code may fail in any way with stand-ins
        reason = f"it cannot be made from the code: {type(error).__name__}: {error}"
        return TheoremObligationResult(name, None, {}, reason=reason)
    return solvers.check(name, obligation, is_expected=is_expected)


def check_mutants(
    theorem: Theorem, solvers: SolverPanel, progress: Callable[[str], None]
) -> list[MutantResult]:
    """Check, for each mutant, the obligation that it must refute, made from the mutant.

    Args:
        theorem: the theorem.
        solvers: solvers to ask.
        progress: called with the name of each mutant before it is checked.

    Returns:
        The results in the order of the mutants.

    Raises:
        InternalError: the obligation does not load the module that the mutant changes.
    """
    checked: list[MutantResult] = []
    for mutant in theorem.mutants:
        progress(mutant.name)
        code = ModuleSource(mutant)
        name = mutant.refuted_obligation
        result = _check_made(name, theorem.obligations[name], code, solvers, is_expected=False)
        if result.obligation is not None and mutant.module not in code.loaded:
            raise InternalError(f"`{name}` is not made of `{mutant.module}`, which `{mutant.name}` breaks")
        checked.append(MutantResult(mutant, result))
    return checked
