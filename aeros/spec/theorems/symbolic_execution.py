"""Runs code over every answer to whatever it asks, and keeps what came of it as a decision diagram.

Symbolic execution by re-execution.  Code is given symbolic values; where it branches on one, the
truth of that condition is asked for, and the code is run again until each question that comes up has
been answered both ways.  Questions are formulas, so the diagram says of which inputs the code gives
which result: it covers every input, and two results never share one, as each node asks one question.

The code must be deterministic: what it asks next may depend on earlier answers and nothing else.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Final

from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.theorems.smtlib import FALSE, TRUE, smt_apply, smt_literal

DecideBranch = Callable[[str], bool]
"""Whether a formula holds of the input: as it was answered before on this run, else both ways in turn."""

_MAX_RUNS: Final = 2_000_000


@dataclass(frozen=True, slots=True)
class DecisionNode:
    """A question, and what the code does on either answer to it."""

    question: str
    if_true: DecisionDiagram
    if_false: DecisionDiagram


DecisionDiagram = DecisionNode | str
"""What code does, by the answers to its questions; a leaf is its result, as an SMT-LIB term."""


class SymbolicValue:
    """A value that only a formula names; what is computed of it is a formula, what is compared is asked.

    Not hashable: a set or a mapping would answer by identity, without asking.
    """

    __slots__ = ("ask", "term")
    __hash__ = None  # type: ignore[assignment]

    def __init__(self, term: str, ask: DecideBranch) -> None:
        self.term = term
        self.ask = ask

    def __bool__(self) -> bool:
        return self.ask(self.term)

    def __repr__(self) -> str:
        return self.term

    def __format__(self, _: str) -> str:
        return self.term  # in what is said to people

    def _apply(self, operator: str, *parts: Any) -> SymbolicValue:
        return SymbolicValue(smt_apply(operator, *map(term_of, parts)), self.ask)

    def __eq__(self, other: object) -> Any:
        return self._apply("=", self, other)

    def __ne__(self, other: object) -> Any:
        return self._apply("not", self._apply("=", self, other))

    def __lt__(self, other: Any) -> SymbolicValue:
        return self._apply("<", self, other)

    def __le__(self, other: Any) -> SymbolicValue:
        return self._apply("<=", self, other)

    def __gt__(self, other: Any) -> SymbolicValue:
        return self._apply("<", other, self)

    def __ge__(self, other: Any) -> SymbolicValue:
        return self._apply("<=", other, self)

    def __add__(self, other: Any) -> SymbolicValue:
        return self._apply("+", self, other)

    def __radd__(self, other: Any) -> SymbolicValue:
        return self._apply("+", other, self)

    def __sub__(self, other: Any) -> SymbolicValue:
        return self._apply("-", self, other)

    def __rsub__(self, other: Any) -> SymbolicValue:
        return self._apply("-", other, self)

    def __mul__(self, other: Any) -> SymbolicValue:
        return self._apply("*", self, other)

    def __rmul__(self, other: Any) -> SymbolicValue:
        return self._apply("*", other, self)

    def __neg__(self) -> SymbolicValue:
        return self._apply("-", self)

    def __abs__(self) -> SymbolicValue:
        return self._apply("ite", SymbolicValue(f"(<= 0 {self.term})", self.ask), self, -self)


def term_of(value: Any) -> str:
    """The term of a symbol or of a constant."""
    if isinstance(value, SymbolicValue):
        return value.term
    if isinstance(value, bool | int | Fraction):
        return smt_literal(value)
    if isinstance(value, float):
        return smt_literal(Fraction(value))
    raise InternalError(f"a symbolic value met {value!r}, which no formula speaks of")


def execute_symbolically(run: Callable[[DecideBranch], str], raising: str | None = None) -> DecisionDiagram:
    """What `run` does for every way in which its questions can be answered.

    run: is given what answers its questions, and returns its result as an SMT-LIB term.
    raising: the result where it raises; None where nobody expects that, and it ends everything.
    """
    explored: list[tuple[tuple[tuple[str, bool], ...], str]] = []
    forced: list[tuple[str, bool]] = []
    for _ in range(_MAX_RUNS):
        path = _ForcedRun(forced)
        result = _result(run, path, raising)
        explored.append((tuple(path.asked.items()), result))
        forced = list(path.asked.items())
        while forced and not forced[-1][1]:
            forced.pop()
        if not forced:
            return _DiagramTable().intern(explored, 0)
        forced[-1] = (forced[-1][0], False)
    raise InternalError(f"more than {_MAX_RUNS} runs do not end it")


def _result(run: Callable[[DecideBranch], str], path: DecideBranch, raising: str | None) -> str:
    try:
        return run(path)
    except InternalError:
        raise
    except Exception:
        if raising is None:
            raise
        return raising


class _ForcedRun:
    """One run: the answers that lead there, then `holds` to everything new."""

    def __init__(self, forced: list[tuple[str, bool]]) -> None:
        self._forced = forced
        self.asked: dict[str, bool] = {}

    def __call__(self, question: str) -> bool:
        if question in (TRUE, FALSE):
            return question == TRUE
        if question not in self.asked:
            place, answer = len(self.asked), True
            if place < len(self._forced):
                expected, answer = self._forced[place]
                if expected != question:
                    raise InternalError(f"asked `{question}` where the run before asked `{expected}`")
            self.asked[question] = answer
        return self.asked[question]


class _DiagramTable:
    """Diagrams without repetition: equal ones are one, and no question is asked that makes no difference."""

    def __init__(self) -> None:
        self._nodes: dict[tuple[str, int | str, int | str], DecisionNode] = {}

    def intern(self, explored: list[tuple[tuple[tuple[str, bool], ...], str]], depth: int) -> DecisionDiagram:
        asked, result = explored[0]
        if depth == len(asked):
            return result
        question = asked[depth][0]
        sides = [[one for one in explored if one[0][depth][1] is side] for side in (True, False)]
        holds, fails = (self.intern(side, depth + 1) for side in sides)
        if _identity(holds) == _identity(fails):
            return holds
        key = (question, _identity(holds), _identity(fails))
        return self._nodes.setdefault(key, DecisionNode(question, holds, fails))


def _identity(diagram: DecisionDiagram) -> int | str:
    return diagram if isinstance(diagram, str) else id(diagram)


def smtlib_definitions(diagram: DecisionDiagram, name: str, sort: str) -> tuple[str, ...]:
    """SMT-LIB definitions of `name`, a term of `sort`: the result of the code on any input."""
    lines: list[str] = []
    known: dict[int, str] = {}

    def named(part: DecisionDiagram) -> str:
        if isinstance(part, str):
            return part
        if id(part) not in known:
            holds, fails = named(part.if_true), named(part.if_false)
            known[id(part)] = f"{name}.{len(known)}"
            lines.append(f"(define-fun {known[id(part)]} () {sort} (ite {part.question} {holds} {fails}))")
        return known[id(part)]

    result = named(diagram)
    return (*lines, f"(define-fun {name} () {sort} {result})")


def questions_in(diagram: DecisionDiagram) -> tuple[str, ...]:
    """Everything that is asked anywhere in it."""
    found: dict[str, None] = {}
    seen: set[int] = set()
    pending = [diagram]
    while pending:
        part = pending.pop()
        if isinstance(part, DecisionNode) and id(part) not in seen:
            seen.add(id(part))
            found[part.question] = None
            pending += (part.if_false, part.if_true)
    return tuple(found)


def path_for_answers(
    diagram: DecisionDiagram, answers: Mapping[str, bool]
) -> tuple[list[tuple[str, bool]], str]:
    """The questions that are asked and their answers, and the result, where the input answers so."""
    asked: list[tuple[str, bool]] = []
    while isinstance(diagram, DecisionNode):
        answer = answers[diagram.question]
        asked.append((diagram.question, answer))
        diagram = diagram.if_true if answer else diagram.if_false
    return asked, diagram
