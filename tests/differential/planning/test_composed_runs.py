"""Runs of compositions against a walk over every path, one by one, without merged states."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from random import Random
from typing import NamedTuple

import pytest

from aeros.spec.closed_loop.composed_run import ROLES, Role, Weights
from aeros.spec.closed_loop.invocation import Invocation, State
from aeros.spec.consequences.stopped_parts import stop_of_part
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import is_true
from aeros.spec.model.composition import Part, Step
from aeros.spec.model.ecm import ActionCondition, Outcome, Skill
from aeros.spec.model.rules import Conjunct
from aeros.spec.model.step_graph import (
    FailingPart,
    Fallback,
    HeldPart,
    If,
    RetriedPart,
    Seq,
    StoppablePart,
    TimedPart,
    steps_of,
)
from tests.unit.agent.dumplings import SPAN, STATE, given_input, skill, term
from tests.unit.spec.closed_loop.test_composed_run import NAMES, made_run

_CONDITIONS = (*NAMES, *(f"not {name}" for name in NAMES), f"{NAMES[0]} and {NAMES[1]}", "false")
_GOALS = ("false", "false", NAMES[2], f"not {NAMES[1]}", f"{NAMES[0]} and {NAMES[1]}")
Counts = tuple[int, int, int]
NO_COUNTS: Counts = (0, 0, 0)


class Path(NamedTuple):
    """One way in which a part may end: "done", "failed", or the held part whose condition is broken."""

    end: str | HeldPart[Step]
    state: State
    share: Fraction
    counts: Counts = NO_COUNTS


@dataclass
class Walk:
    """Every path of a composition, by the rules of the agent's executor."""

    handlers: Mapping[str, Step]
    skills: Mapping[str, Skill]
    goal: t.Term
    uncertain: tuple[str, ...]
    held: list[HeldPart[Step]] = field(default_factory=list)
    may_stop: list[set[State]] = field(default_factory=list)
    may_go_on: bool = False
    through: set[State] = field(default_factory=set)
    made: dict[tuple[object, ...], Invocation] = field(default_factory=dict)

    def holds(self, condition: t.Term, state: State) -> bool:
        return is_true(condition, dict(zip(NAMES, state, strict=True)))

    def invocation(self, name: str, inputs: Mapping[str, Fraction]) -> Invocation:
        key = (name, *inputs.values())
        if key not in self.made:
            self.made[key] = Invocation(self.skills[name], inputs, NAMES)
        return self.made[key]

    def ends(self, part: Part, path: Path, role: Role) -> Iterator[Path]:
        """Every end of a part that begins where a path has led."""
        over = self.holds(self.goal, path.state)
        match part:
            case Step():
                yield from self.tries(part, path, role, part.retry)
            case Seq(parts=()):
                yield path
            case Seq(parts=(first, *rest)):
                for one in self.ends(first, path, role):
                    yield from self.ends(Seq(tuple(rest)), one, role) if one.end == "done" else [one]
            case If(condition=condition):
                for value in (False, True):
                    for name in self.uncertain:
                        known = dict(zip(NAMES, path.state, strict=True))
                        if not over and is_true(condition, known) != is_true(
                            condition, known | {name: value}
                        ):
                            yield Path("failed", path.state, Fraction(0))
                chosen = part.then if self.holds(condition, path.state) else part.otherwise
                if over:
                    yield path
                else:
                    yield from (
                        [path._replace(end="failed")] if chosen is None else self.ends(chosen, path, role)
                    )
            case Fallback(parts=parts):
                yield from self.in_turn([(one, role) for one in parts], path)
            case RetriedPart(part=one, retry=retry):
                again: Role = "retry"
                yield from self.in_turn([(one, role), *[(one, again)] * retry], path)
            case FailingPart():
                yield path if over else path._replace(end="failed")
            case HeldPart() | TimedPart():
                yield from self.stoppable(part, path, role)

    def in_turn(self, parts: list[tuple[Part, Role]], path: Path) -> Iterator[Path]:
        outer = self.may_go_on
        (part, role), *rest = parts
        self.may_go_on = outer or bool(rest)
        found = list(self.ends(part, path, role))
        self.may_go_on = outer
        for one in found:
            if one.end == "failed" and rest:
                yield from self.in_turn(rest, one._replace(end="done"))
            else:
                yield one

    def stoppable(self, part: StoppablePart[Step], path: Path, role: Role) -> Iterator[Path]:
        if self.holds(self.goal, path.state):
            yield path
            return
        if isinstance(part, HeldPart):
            if not self.holds(part.condition.term, path.state):
                yield path._replace(end="failed")
                return
            self.held.append(part)
        self.may_stop.append({path.state})
        found, stopped = list(self.ends(part.part, path, role)), self.may_stop.pop()
        if isinstance(part, HeldPart):
            self.held.pop()
        yield from (one._replace(end="failed") if one.end is part else one for one in found)
        stop = Invocation(stop_of_part(part, self.handlers, self.skills, STATE, {}), {}, NAMES, NAMES)
        for state in stopped:
            for after, _, _ in stop.after(state):
                self.through.add(after)
                yield Path("failed", after, Fraction(0))

    def tries(self, one: Step, path: Path, role: Role, left: int) -> Iterator[Path]:
        """Every end of a step that may be tried `left` times more."""
        if self.holds(self.goal, path.state):
            yield path
            return
        made = (self.invocation(name, one.inputs) for name in one.runs)
        able = [each for each in made if each.can_start(path.state)]
        if not able:
            yield from [path._replace(end="failed")] if left == one.retry else self.lost(one, path)
        for each in able:
            for stops in self.may_stop:
                stops.update(each.stopped(path.state))
            for state, outcome, share in each.after(path.state):
                self.through.add(state)
                counts = [at + (name == role) for at, name in zip(path.counts, ROLES, strict=True)]
                after = Path("done", state, path.share * share / len(able), (counts[0], counts[1], counts[2]))
                over = self.holds(self.goal, state)
                broken = [part for part in self.held if not (over or self.holds(part.condition.term, state))]
                if broken:
                    yield after._replace(end=broken[0])
                elif not outcome.failure:
                    yield after
                else:
                    yield from self.failed(one, after, left)

    def failed(self, one: Step, path: Path, left: int) -> Iterator[Path]:
        if one.last_handler is not None or self.may_go_on:
            yield from self.lost(one, Path("done", path.state, Fraction(0)))
        if not left:
            yield from self.lost(one, path)
        elif one.between_tries is None:
            yield from self.tries(one, path, "retry", left - 1)
        else:
            handler = self.handlers[one.between_tries]
            for end in self.tries(handler, path, "recovery", handler.retry):
                if end.end == "done":
                    yield from self.tries(one, end, "retry", left - 1)
                else:
                    yield from self.lost(one, end) if end.end == "failed" else [end]

    def lost(self, one: Step, path: Path) -> Iterator[Path]:
        """Every end of a step that is tried no more."""
        if one.last_handler is None or self.holds(self.goal, path.state):
            yield path._replace(end="failed")
        else:
            handler = self.handlers[one.last_handler]
            for end in self.tries(handler, path, "recovery", handler.retry):
                yield end._replace(end="failed") if end.end == "done" else end


def _skill(drawn: Random, name: str) -> Skill:
    weights = [drawn.randint(1, 3) for _ in range(drawn.choice([1, 2, 2, 2]))]
    outcomes = [
        Outcome(
            f"outcome_{at}",
            {drawn.choice(NAMES): drawn.random() < 0.7} if drawn.random() < 0.8 else {},
            failure=drawn.random() < (0.3, 0.8)[at],
            probability=Fraction(weight, sum(weights)),
            duration=None,
        )
        for at, weight in enumerate(weights)
    ]
    needed = drawn.choice([*[None] * 8, *_CONDITIONS[:-1], "inputs.force > 0.4"])
    inputs = {"force": given_input("force", Fraction(1, 2), (Fraction(0), Fraction(1)))}
    return skill(name, *outcomes, precondition=needed, inputs=inputs)


def _step(drawn: Random, *handlers: str) -> Step:
    between, last = (drawn.choice([None, *handlers]) for _ in range(2))
    choices = tuple(drawn.sample(["a", "b", "c"], drawn.randint(1, 2)))
    inputs = drawn.choice([{}, {"force": Fraction(1, 4)}, {"force": Fraction(3, 4)}])
    retry = drawn.choice([0, 1, 1, 2]) if handlers else 0
    return Step("s", "s", inputs, {}, retry, between, last, SPAN, choices)


def _part(drawn: Random, depth: int) -> Part:
    text = drawn.choice(_CONDITIONS)
    inner = [_part(drawn, depth - 1) for _ in range(2)] if depth else []
    match drawn.choice(["seq", "if", "any", "again", "check", "hold", "hold", "within"]) if depth else "step":
        case "seq":
            return Seq(tuple(inner))
        case "if":
            return If(term(text), text, inner[0], drawn.choice([None, inner[1]]), SPAN)
        case "any":
            return Fallback(tuple(inner), SPAN)
        case "again":
            return RetriedPart(inner[0], 1, SPAN)
        case "hold":
            clause = ActionCondition(term(text), text, SPAN, (Conjunct(term(text), SPAN),))
            return HeldPart(inner[0], SPAN, True, clause)
        case "within":
            return TimedPart(inner[0], SPAN, True, Fraction(10))
        case "check":
            return Seq((inner[0], If(term(text), text, Seq(()), FailingPart(text, SPAN), SPAN)))
        case _:
            return _step(drawn, "h", "k")


def _by_state(ends: list[Path]) -> dict[State, tuple[Fraction, ...]]:
    """Probability and expected submissions of each state."""
    found: dict[State, list[Fraction]] = {}
    for one in ends:
        sums = found.setdefault(one.state, [Fraction(0)] * (1 + len(ROLES)))
        for at, times in enumerate((1, *one.counts)):
            sums[at] += one.share * times
    return {state: tuple(sums) for state, sums in found.items()}


def _shown(weights: Weights) -> dict[State, tuple[Fraction, ...]]:
    return {state: (one.probability, *one.counts) for state, one in weights.items()}


def compare(seed: int) -> bool:
    """Compare all runs of a drawn composition; return true if the walk was short enough."""
    drawn = Random(seed)  # noqa: S311  cases of a test
    skills = {name: _skill(drawn, name) for name in "abc"}
    handlers = {"h": _step(drawn), "k": _step(drawn)}
    body = _part(drawn, drawn.choice([1, 2]))
    if len(list(steps_of(body))) > 2:
        return False
    goal = term(drawn.choice(_GOALS))
    uncertain = drawn.choice([(), NAMES[:1], NAMES[1:2]])
    run = made_run(body, goal, uncertain, skills, handlers, lambda part: False)
    role = drawn.choice(ROLES)
    for state in [(False, False, False), (False, True, False), (True, False, True)]:
        walk = Walk(handlers, skills, goal, uncertain)
        ends = list(walk.ends(body, Path("done", state, Fraction(1)), role))
        done, failed, through = run.run(state, role)
        assert _shown(done) == _by_state([one for one in ends if one.end == "done"])
        assert _shown(failed) == _by_state([one for one in ends if one.end == "failed"])
        assert through == walk.through
        assert (run.is_exact, run.is_success_known, run.is_open) == (True, True, False)
    return True


@pytest.mark.parametrize(
    "seeds", [range(50, 150), pytest.param(range(1000, 5000), marks=pytest.mark.deep)], ids=["few", "many"]
)
def test_merged_states_have_the_weights_of_all_paths(seeds: range) -> None:
    compared = sum(map(compare, seeds))
    assert compared > len(seeds) / 3
