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
from aeros.spec.theorems.smtlib import FALSE, TRUE, application, literal

Ask = Callable[[str], bool]
"""Whether a formula holds of the input: as it was answered before on this run, else both ways in turn."""

_MOST_RUNS: Final = 2_000_000


@dataclass(frozen=True, slots=True)
class Node:
    """A question, and what the code does on either answer to it."""

    question: str
    holds: Diagram
    fails: Diagram


Diagram = Node | str
"""What code does, by the answers to its questions; a leaf is its result, as an SMT-LIB term."""


class Symbol:
    """A value that only a formula names; what is computed of it is a formula, what is compared is asked.

    Not hashable: a set or a mapping would answer by identity, without asking.
    """

    __slots__ = ("ask", "term")
    __hash__ = None  # type: ignore[assignment]

    def __init__(self, term: str, ask: Ask) -> None:
        self.term = term
        self.ask = ask

    def __bool__(self) -> bool:
        return self.ask(self.term)

    def __repr__(self) -> str:
        return self.term

    def __format__(self, _: str) -> str:
        return self.term  # in what is said to people

    def _with(self, operator: str, *parts: Any) -> Symbol:
        return Symbol(application(operator, *map(term_of, parts)), self.ask)

    def __eq__(self, other: object) -> Any:
        return self._with("=", self, other)

    def __ne__(self, other: object) -> Any:
        return self._with("not", self._with("=", self, other))

    def __lt__(self, other: Any) -> Symbol:
        return self._with("<", self, other)

    def __le__(self, other: Any) -> Symbol:
        return self._with("<=", self, other)

    def __gt__(self, other: Any) -> Symbol:
        return self._with("<", other, self)

    def __ge__(self, other: Any) -> Symbol:
        return self._with("<=", other, self)

    def __add__(self, other: Any) -> Symbol:
        return self._with("+", self, other)

    def __radd__(self, other: Any) -> Symbol:
        return self._with("+", other, self)

    def __sub__(self, other: Any) -> Symbol:
        return self._with("-", self, other)

    def __rsub__(self, other: Any) -> Symbol:
        return self._with("-", other, self)

    def __mul__(self, other: Any) -> Symbol:
        return self._with("*", self, other)

    def __rmul__(self, other: Any) -> Symbol:
        return self._with("*", other, self)

    def __neg__(self) -> Symbol:
        return self._with("-", self)

    def __abs__(self) -> Symbol:
        return self._with("ite", Symbol(f"(<= 0 {self.term})", self.ask), self, -self)


def term_of(value: Any) -> str:
    """The term of a symbol or of a constant."""
    if isinstance(value, Symbol):
        return value.term
    if isinstance(value, bool | int | Fraction):
        return literal(value)
    if isinstance(value, float):
        return literal(Fraction(value))
    raise InternalError(f"a symbolic value met {value!r}, which no formula speaks of")


def explore(run: Callable[[Ask], str], raising: str | None = None) -> Diagram:
    """What `run` does for every way in which its questions can be answered.

    run: is given what answers its questions, and returns its result as an SMT-LIB term.
    raising: the result where it raises; None where nobody expects that, and it ends everything.
    """
    explored: list[tuple[tuple[tuple[str, bool], ...], str]] = []
    forced: list[tuple[str, bool]] = []
    for _ in range(_MOST_RUNS):
        path = _Path(forced)
        result = _result(run, path, raising)
        explored.append((tuple(path.asked.items()), result))
        forced = list(path.asked.items())
        while forced and not forced[-1][1]:
            forced.pop()
        if not forced:
            return _Diagrams().of(explored, 0)
        forced[-1] = (forced[-1][0], False)
    raise InternalError(f"more than {_MOST_RUNS} runs do not end it")


def _result(run: Callable[[Ask], str], path: Ask, raising: str | None) -> str:
    try:
        return run(path)
    except InternalError:
        raise
    except Exception:
        if raising is None:
            raise
        return raising


class _Path:
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


class _Diagrams:
    """Diagrams without repetition: equal ones are one, and no question is asked that makes no difference."""

    def __init__(self) -> None:
        self._nodes: dict[tuple[str, int | str, int | str], Node] = {}

    def of(self, explored: list[tuple[tuple[tuple[str, bool], ...], str]], depth: int) -> Diagram:
        asked, result = explored[0]
        if depth == len(asked):
            return result
        question = asked[depth][0]
        sides = [[one for one in explored if one[0][depth][1] is side] for side in (True, False)]
        holds, fails = (self.of(side, depth + 1) for side in sides)
        if _identity(holds) == _identity(fails):
            return holds
        key = (question, _identity(holds), _identity(fails))
        return self._nodes.setdefault(key, Node(question, holds, fails))


def _identity(diagram: Diagram) -> int | str:
    return diagram if isinstance(diagram, str) else id(diagram)


def definitions(diagram: Diagram, name: str, sort: str) -> tuple[str, ...]:
    """SMT-LIB definitions of `name`, a term of `sort`: the result of the code on any input."""
    lines: list[str] = []
    known: dict[int, str] = {}

    def named(part: Diagram) -> str:
        if isinstance(part, str):
            return part
        if id(part) not in known:
            holds, fails = named(part.holds), named(part.fails)
            known[id(part)] = f"{name}.{len(known)}"
            lines.append(f"(define-fun {known[id(part)]} () {sort} (ite {part.question} {holds} {fails}))")
        return known[id(part)]

    result = named(diagram)
    return (*lines, f"(define-fun {name} () {sort} {result})")


def questions(diagram: Diagram) -> tuple[str, ...]:
    """Everything that is asked anywhere in it."""
    found: dict[str, None] = {}
    seen: set[int] = set()
    pending = [diagram]
    while pending:
        part = pending.pop()
        if isinstance(part, Node) and id(part) not in seen:
            seen.add(id(part))
            found[part.question] = None
            pending += (part.fails, part.holds)
    return tuple(found)


def way_through(diagram: Diagram, answers: Mapping[str, bool]) -> tuple[list[tuple[str, bool]], str]:
    """The questions that are asked and their answers, and the result, where the input answers so."""
    asked: list[tuple[str, bool]] = []
    while isinstance(diagram, Node):
        answer = answers[diagram.question]
        asked.append((diagram.question, answer))
        diagram = diagram.holds if answer else diagram.fails
    return asked, diagram
