"""Processes as they ship, explored: what each does to what it shares with others, step by step, as a graph.

`execute_process` runs code again and again, with stand-ins that tell of each step and give every answer in
turn.
Between two steps anything else may happen, so a step of the graph is what the theorem says is one instant.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.theorems.smtlib import smt_and, smt_implies, smt_or

PerformStep = Callable[..., str]
"""`do(what, *answers)`: does one step, and gives one of the answers; without any, the empty one."""

StepPath = tuple[tuple[str, str], ...]
"""The steps that were done and their answers."""

_MAX_RUNS = 10_000


@dataclass(frozen=True)
class ProcessGraph:
    """Graph of a process's steps, from place 0 on.

    Attributes:
        ways: how each place is reached.
        steps: from where, what, the answer, to where.
        ends: places where it ends, and its result.
    """

    paths: Sequence[StepPath]
    steps: Sequence[tuple[int, str, str, int]]
    end_results: Mapping[int, str]

    def merge_places(self, fact: Callable[[StepPath], Iterable[str]]) -> ProcessGraph:
        """The same, with one place for all of which `fact` says the same and that the same follows."""
        leading: dict[int, list[tuple[str, str, int]]] = {}
        for at, what, answer, to in self.steps:
            leading.setdefault(at, []).append((what, answer, to))
        same: dict[int, int] = {}
        known: dict[object, int] = {}
        # Each place comes after the places on the way to it, so what follows one is merged before it.
        for at in sorted(range(len(self.paths)), key=lambda one: -len(self.paths[one])):
            follows = tuple((what, answer, same[to]) for what, answer, to in leading.get(at, ()))
            key = (tuple(fact(self.paths[at])), follows, self.end_results.get(at))
            same[at] = known.setdefault(key, at)
        kept = {old: new for new, old in enumerate(dict.fromkeys(same[at] for at in range(len(self.paths))))}
        steps = {
            (kept[same[at]], what, answer, kept[same[to]]): None
            for at, what, answer, to in self.steps
            if same[at] == at
        }
        ends = {kept[same[at]]: result for at, result in self.end_results.items()}
        return ProcessGraph(tuple(self.paths[old] for old in kept), tuple(steps), ends)

    def step_formula(self, pc: str, effect: Callable[[str, str, int], str]) -> str:
        """That it does one step: the formula over `pc` and the state before, `pc~` and the state after.

        effect: what a step does, by its name, its answer, and the place that it leads to.
        """
        return smt_or(
            smt_and([f"(= {pc} {at})", f"(= {pc}~ {to})", effect(what, answer, to)])
            for at, what, answer, to in self.steps
        )

    def invariant_formula(self, pc: str, fact: Callable[[StepPath], Iterable[str]]) -> str:
        """That at each place holds what `fact` says of the way there, and there is no other place."""
        facts = [smt_implies(f"(= {pc} {at})", smt_and(fact(way))) for at, way in enumerate(self.paths)]
        return smt_and([f"(<= 0 {pc} {len(self.paths) - 1})", *facts])


def execute_process(run: Callable[[PerformStep], str]) -> ProcessGraph:
    """Explore `run` for each answer to each of its steps; `run` returns its result."""
    places: dict[StepPath, int] = {(): 0}
    steps: dict[tuple[int, str, str, int], None] = {}
    ends: dict[int, str] = {}
    pending: list[StepPath] = [()]
    for _ in range(_MAX_RUNS):
        if not pending:
            return ProcessGraph(tuple(places), tuple(steps), ends)
        one = _ForcedRun(pending.pop())
        result = run(one)
        pending += one.untried
        for length, (what, answer) in enumerate(one.done):
            way = tuple(one.done[: length + 1])
            place = places.setdefault(way, len(places))
            steps[places[way[:-1]], what, answer, place] = None
        ends[places[tuple(one.done)]] = result
    raise InternalError(f"more than {_MAX_RUNS} runs do not end it")


class _ForcedRun:
    """One run: the steps that lead there, then the first answer to everything new."""

    def __init__(self, forced: StepPath) -> None:
        self._forced = forced
        self.done: list[tuple[str, str]] = []
        self.untried: list[StepPath] = []

    def __call__(self, what: str, *answers: str) -> str:
        if len(self.done) < len(self._forced):
            expected, answer = self._forced[len(self.done)]
            if expected != what:
                raise InternalError(f"does `{what}` where the run before did `{expected}`")
        else:
            answer, *others = answers or ("",)
            self.untried += [(*self.done, (what, other)) for other in others]
        self.done.append((what, answer))
        return answer


def transition(state: Sequence[str], after: Mapping[str, str], *conditions: str) -> str:
    """That `conditions` hold, the variables of `after` get these values, and all others of `state` stay."""
    strange = after.keys() - set(state)
    if strange:
        raise InternalError(f"there is no {', '.join(strange)} to be changed")
    return smt_and([*conditions, *(f"(= {name}~ {after.get(name, name)})" for name in state)])


def declare_state(sorts: Mapping[str, str]) -> tuple[str, ...]:
    """Declarations of variables before and after a step."""
    return tuple(f"(declare-const {name}{when} {sort})" for name, sort in sorts.items() for when in ("", "~"))


def primed(formula: str, state: Iterable[str]) -> str:
    """`formula`, of the state after the step."""
    bindings = " ".join(f"({name} {name}~)" for name in state)
    return f"(let ({bindings}) {formula})"
