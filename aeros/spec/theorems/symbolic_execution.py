"""Symbolic execution by re-execution: runs code for every answer to its branch conditions.

The code receives symbolic values. When it branches on one, the truth of that condition is asked for. The code
is run again until each question has been answered both ways, and the results form a decision diagram.
Questions are formulas, so the diagram maps each input to the code's result: it covers every input, and no
input has two results, because each node asks one question.

The code must be deterministic: its next question may depend only on earlier answers.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any, Final

from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.theorems.smtlib import FALSE, TRUE, smt_apply, smt_literal

DecideBranch = Callable[[str], bool]
"""Answers if a formula holds of the input: as before in this run, otherwise both ways in turn."""

_MAX_RUNS: Final = 2_000_000


@dataclass(frozen=True, slots=True)
class DecisionNode:
    """A question of the code, and its behaviour by the answer.

    Attributes:
        question: the question, as an SMT-LIB formula.
        if_true: the diagram for the answer true.
        if_false: the diagram for the answer false.
    """

    question: str
    if_true: DecisionDiagram
    if_false: DecisionDiagram


DecisionDiagram = DecisionNode | str
"""Behaviour of code by the answers to its questions; a leaf is its result, as an SMT-LIB term."""


class SymbolicValue:
    """A value given by a formula: arithmetic on it yields formulas, and its truth value is asked for.

    Not hashable: a set or a mapping would compare by identity, without asking.
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
        return self.term  # in messages

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
    """Write a value as an SMT-LIB term.

    Args:
        value: symbolic value or constant.

    Returns:
        The term.

    Raises:
        InternalError: the value is neither.
    """
    if isinstance(value, SymbolicValue):
        return value.term
    if isinstance(value, bool | int | Fraction):
        return smt_literal(value)
    if isinstance(value, float):
        return _float_literal(value)
    raise InternalError(f"a symbolic value met {value!r}, which no formula speaks of")


@lru_cache(maxsize=1 << 12)
def _float_literal(value: float) -> str:
    return smt_literal(Fraction(value))


def execute_symbolically(run: Callable[[DecideBranch], str], raising: str | None = None) -> DecisionDiagram:
    """Run code for every way in which its questions can be answered.

    Args:
        run: receives the function that answers questions, and returns its result as an SMT-LIB term.
        raising: result of runs that raise an exception; with None, exceptions propagate.

    Returns:
        The decision diagram of the results.

    Raises:
        InternalError: there are more than `_MAX_RUNS` runs, or the code is not deterministic.
    """
    path = _AnsweredPath()
    table = _DiagramTable()
    for _ in range(_MAX_RUNS):
        path.begin()
        found: DecisionDiagram = _result(run, path, raising)
        path.end()
        while path.ends_with_false():
            question, if_true = path.pop()
            found = table.node(question, if_true, found)
        if not path.questions:
            return found
        path.turn(found)
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


class _AnsweredPath:
    """The questions of a run: repeats the answers that are fixed, then answers True to every new question.

    Attributes:
        questions: the questions of the latest run in order, each once.
    """

    def __init__(self) -> None:
        self.questions: list[str] = []
        self._answers: list[bool] = []
        self._if_true: list[DecisionDiagram] = []
        """For each question, the diagram of the answer True, once the answer is False; before, empty."""
        self._places: dict[str, int] = {}
        self._asked = 0

    def __call__(self, question: str) -> bool:
        place = self._places.get(question)
        if place is not None and place < self._asked:
            return self._answers[place]
        if place is None and question in (TRUE, FALSE):
            return question == TRUE
        if self._asked < len(self.questions):
            if place != self._asked:
                expected = self.questions[self._asked]
                raise InternalError(f"asked `{question}` where the run before asked `{expected}`")
            self._asked += 1
            return self._answers[self._asked - 1]
        self._places[question] = self._asked
        self.questions.append(question)
        self._answers.append(True)
        self._if_true.append("")
        self._asked += 1
        return True

    def begin(self) -> None:
        """Begin a run, in which no question has been asked yet."""
        self._asked = 0

    def end(self) -> None:
        """End a run.

        Raises:
            InternalError: it has not asked all questions whose answers are fixed.
        """
        if self._asked < len(self.questions):
            expected = self.questions[self._asked]
            raise InternalError(f"ended where the run before asked `{expected}`")

    def ends_with_false(self) -> bool:
        """Say if the last question has been answered both ways."""
        return bool(self._answers) and not self._answers[-1]

    def pop(self) -> tuple[str, DecisionDiagram]:
        """Remove the last question; return it with the diagram of the answer True."""
        question = self.questions.pop()
        del self._places[question]
        self._answers.pop()
        return question, self._if_true.pop()

    def turn(self, if_true: DecisionDiagram) -> None:
        """Fix the answer False to the last question, whose diagram for the answer True is known now."""
        self._answers[-1] = False
        self._if_true[-1] = if_true


class _DiagramTable:
    """Reduced diagrams: equal ones are one object, and no question has equal results for both answers."""

    def __init__(self) -> None:
        self._nodes: dict[tuple[str, int | str, int | str], DecisionNode] = {}

    def node(self, question: str, if_true: DecisionDiagram, if_false: DecisionDiagram) -> DecisionDiagram:
        """Return the diagram that asks a question."""
        if _identity(if_true) == _identity(if_false):
            return if_true
        key = (question, _identity(if_true), _identity(if_false))
        return self._nodes.setdefault(key, DecisionNode(question, if_true, if_false))


def _identity(diagram: DecisionDiagram) -> int | str:
    return diagram if isinstance(diagram, str) else id(diagram)


def smtlib_definitions(diagram: DecisionDiagram, name: str, sort: str) -> tuple[str, ...]:
    """Write a diagram as SMT-LIB definitions.

    Args:
        diagram: decision diagram.
        name: name of the function to define, whose value is the result of the code.
        sort: its sort.

    Returns:
        The commands, the definition of `name` last.
    """
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
    """List the questions of a diagram.

    Args:
        diagram: decision diagram.

    Returns:
        Each question once.
    """
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
    """Follow a diagram for given answers.

    Args:
        diagram: decision diagram.
        answers: answer to each question.

    Returns:
        The questions on the path with their answers, and the result.
    """
    asked: list[tuple[str, bool]] = []
    while isinstance(diagram, DecisionNode):
        answer = answers[diagram.question]
        asked.append((diagram.question, answer))
        diagram = diagram.if_true if answer else diagram.if_false
    return asked, diagram
