"""Small random tasks over numbers: counts, quantities that outcomes leave in ranges, and compositions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from random import Random
from typing import Any

from aeros.spec.expr import terms as t
from aeros.spec.expr.effects import Increment, QuantityRange
from aeros.spec.expr.parser import parse
from aeros.spec.expr.scope import Scope
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.types import BOOL, IntegerType
from aeros.spec.model.composition import Composition, Part, Step
from aeros.spec.model.ecm import ActionCondition, Ecm, Outcome, Skill, Task, TaskInvariant
from aeros.spec.model.rules import Conjunct
from aeros.spec.model.site import Site
from aeros.spec.model.step_graph import (
    FailingPart,
    Fallback,
    HeldPart,
    If,
    Par,
    RetriedPart,
    Seq,
    TimedPart,
)
from tests.unit.agent import dumplings
from tests.unit.agent.dumplings import SPAN, rule, skill

_MOST = 4
STATE = {
    **dumplings.STATE,
    "count": dumplings.state("count", IntegerType(), (Fraction(0), Fraction(_MOST))),
}
_SCOPE = Scope(
    {name: one.variable for name, one in STATE.items()},
    inputs={},
    enums={"area": dumplings.AREA, "joints": dumplings.JOINTS},
)
_FLAGS = ("dumpling_wrapped", "dumpling_cooked")
_OTHER_FLAGS = ("dough_on_workspace", "wrapper_aligned")
_CONDITIONS = (
    *_FLAGS,
    f"not {_FLAGS[0]}",
    "count >= 3",
    "count < 2",
    "count == 1",
    "count + 1 <= 3",
    "fill_level > 0.5",
    "fill_level <= 0.2",
    "abs(fill_level - 0.5) < 0.25",
    "min(fill_level, 0.7) >= 0.6",
    "tool.z > 100 mm",
    "tool.z <= 100 mm",
    "joint[j1] < 0",
)

Loop = tuple[Ecm, Task, Site]


def term(text: str) -> t.Term:
    """A condition over the state."""
    return check(parse(text), _SCOPE, BOOL)


def number_loop(seed: int) -> Loop:
    """A task with rules over numbers, whose increments stay in their range."""
    drawn = Random(seed)  # noqa: S311  cases of a test
    skills = [_counting_skill(drawn, f"skill_{at}") for at in range(drawn.randint(1, 3))]
    names = [one.id for one in skills]
    rules = []
    for _ in range(drawn.randint(1, 3)):
        between, last = (drawn.choice([None, None, *names]) for _ in range(2))
        unless = _condition(drawn)
        made = rule(_FLAGS[0], drawn.choice(names), drawn.randint(0, 2), between, last)
        rules.append(replace(made, satisfied_condition=term(unless), text=unless))
    initial: dict[str, Any] = {}
    if drawn.random() < 0.8:
        initial["count"] = Fraction(drawn.randint(0, _MOST))
    if drawn.random() < 0.7:
        initial["fill_level"] = Fraction(drawn.randint(0, 10), 10)
    if drawn.random() < 0.7:
        initial[_FLAGS[0]] = False
    kept = (_condition(drawn), f"({_condition(drawn)}) or ({_condition(drawn)}) or {_condition(drawn)}")
    return _loop(tuple(skills), rules, _condition(drawn), initial, kept)


def composed_loop(seed: int) -> Loop:
    """A task whose step is a composition; parallel branches are over different flags."""
    drawn = Random(seed)  # noqa: S311  cases of a test
    skills = [
        *(_flag_skill(drawn, f"left_{at}", _FLAGS) for at in range(3)),
        *(_flag_skill(drawn, f"right_{at}", _OTHER_FLAGS) for at in range(3)),
    ]
    left, right = (
        {f"{side}_cure": _step(drawn, f"{side}_0", ()), f"{side}_last": _step(drawn, f"{side}_1", ())}
        for side in ("left", "right")
    )
    body: Part = _part(drawn, "left", tuple(left), 2)
    if drawn.random() < 0.6:
        body = Par((body, _part(drawn, "right", tuple(right), 2)), SPAN)
    if drawn.random() < 0.5:
        body = Seq((body, _part(drawn, "left", tuple(left), 1)))
    composition = Composition(
        "work", term(drawn.choice(["true", "true", f"not {_FLAGS[1]}"])), None, body, {**left, **right}, SPAN
    )
    made = replace(
        rule(drawn.choice([*_FLAGS, *_OTHER_FLAGS]), "working", drawn.randint(0, 1)),
        between_tries=drawn.choice([None, "left_2"]),
        on_failure=drawn.choice([None, "right_2"]),
    )
    ecm, task, site = _loop(
        tuple(skills),
        [made],
        drawn.choice([*_FLAGS, f"{_FLAGS[0]} and {_OTHER_FLAGS[0]}", f"not {_OTHER_FLAGS[1]}"]),
        dict.fromkeys(drawn.sample([*_FLAGS, *_OTHER_FLAGS], 2), False),
        (f"{drawn.choice(_FLAGS)} or not {drawn.choice(_OTHER_FLAGS)}",),
    )
    ecm = replace(ecm, compositions={"work": composition}, capabilities={"working": ("work",)})
    return ecm, task, site


def stopped_loop(seed: int) -> Loop:
    """A task whose step is a composition that may be stopped while one of its parallel steps counts."""
    drawn = Random(seed)  # noqa: S311  cases of a test
    skills = [_without_quantities(_counting_skill(drawn, f"left_{at}")) for at in range(2)]
    skills += [_flag_skill(drawn, f"right_{at}", _OTHER_FLAGS) for at in range(2)]
    branches = Par(tuple(_step(drawn, f"{side}_0", ()) for side in ("left", "right")), SPAN)
    condition = drawn.choice(["count < 3", "count >= 1", _FLAGS[0]])
    held = ActionCondition(term(condition), condition, SPAN, (Conjunct(term(condition), SPAN),))
    body: Part = TimedPart(branches, SPAN, True, Fraction(10))
    if drawn.random() < 0.5:
        inner: Part = branches if drawn.random() < 0.5 else _step(drawn, "left_0", ())
        body = HeldPart(inner, SPAN, True, held)
    composition = Composition("work", t.TRUE, None, body, {}, SPAN)
    rules = [rule(drawn.choice(_FLAGS), "working", drawn.randint(0, 1))]
    rules += [rule(drawn.choice(_OTHER_FLAGS), drawn.choice(["left_1", "right_1"]))] * drawn.randint(0, 1)
    initial = {"count": Fraction(drawn.randint(0, _MOST))}
    goal = drawn.choice([_FLAGS[0], _condition(drawn)])
    ecm, task, site = _loop(tuple(skills), rules, goal, initial, (_condition(drawn), "count >= 0"))
    ecm = replace(ecm, compositions={"work": composition}, capabilities={"working": ("work",)})
    return ecm, task, site


def _without_quantities(one: Skill) -> Skill:
    """Leave out effects on quantities: after a stop each would have every value, beside every count."""
    outcomes = {
        name: replace(
            outcome,
            effects={key: value for key, value in outcome.effects.items() if key != "fill_level"},
            ranges=(),
        )
        for name, outcome in one.outcomes.items()
    }
    return replace(one, outcomes=outcomes)


def _loop(
    skills: tuple[Skill, ...], rules: Sequence[Any], goal: str, initial: dict[str, Any], kept: Sequence[str]
) -> Loop:
    task = replace(
        dumplings.task("task", ("word",), _FLAGS[0], *rules),
        goal=term(goal),
        goal_text=goal,
        initial=initial,
        invariants=tuple(TaskInvariant(f"kept_{at}", term(one), one, SPAN) for at, one in enumerate(kept)),
    )
    return dumplings.module("small", skills, task), task, replace(dumplings.site(), state=STATE)


def _condition(drawn: Random) -> str:
    first, second = drawn.choice(_CONDITIONS), drawn.choice(_CONDITIONS)
    return drawn.choice([first, f"{first} {drawn.choice(['and', 'or'])} {second}"])


def _counting_skill(drawn: Random, name: str) -> Skill:
    outcomes = []
    for at in range(drawn.randint(1, 3)):
        effects, ranges = _effects(drawn)
        outcomes.append(Outcome(f"outcome_{at}", effects, drawn.random() < 0.4, None, None, ranges=ranges))
    added = {one.effects["count"].amount for one in outcomes if _is_counted(one)}
    needed = [_condition(drawn)] if drawn.random() < 0.5 else []
    needed = [f"({one})" for one in needed] if added else needed
    needed += [f"count < {_MOST}"] if any(one > 0 for one in added) else []
    needed += ["count > 0"] if any(one < 0 for one in added) else []
    made = skill(name, *outcomes)
    if needed:
        text = " and ".join(needed)
        made = replace(made, precondition=ActionCondition(term(text), text, SPAN))
    return made


def _is_counted(outcome: Outcome) -> bool:
    return isinstance(outcome.effects.get("count"), Increment)


def _effects(drawn: Random) -> tuple[dict[str, Any], tuple[QuantityRange, ...]]:
    effects: dict[str, Any] = {}
    ranges: dict[str, QuantityRange] = {}
    for _ in range(drawn.choice([0, 1, 1, 2])):
        match drawn.choice(["flag", "flag", "count", "count", "level", "height"]):
            case "flag":
                effects[drawn.choice(_FLAGS)] = drawn.random() < 0.7
            case "count":
                changes = [Increment(Fraction(1)), Increment(Fraction(-1)), Fraction(0), Fraction(3)]
                effects["count"] = drawn.choice(changes)
            case "level" if drawn.random() < 0.5:
                effects["fill_level"] = Fraction(drawn.randint(0, 10), 10)
            case "level":
                low = drawn.randint(0, 9)
                high = Fraction(drawn.randint(low, 10), 10)
                ranges["fill_level"] = QuantityRange("fill_level", None, Fraction(low, 10), high)
            case _:
                low = drawn.randint(-9, 9)
                ranges["tool"] = QuantityRange("tool", 2, Fraction(low, 10), Fraction(low + 1, 10))
    kept = tuple(one for name, one in ranges.items() if name not in effects)
    return effects, kept


def _flag_skill(drawn: Random, name: str, flags: Sequence[str]) -> Skill:
    outcomes = [
        Outcome(
            f"outcome_{at}",
            {drawn.choice(flags): drawn.random() < 0.7},
            at > 0 and drawn.random() < 0.7,
            None,
            None,
        )
        for at in range(drawn.randint(1, 3))
    ]
    if drawn.random() < 0.2:
        outcomes[0] = replace(outcomes[0], probability=Fraction(1))
    precondition = drawn.choice([None, None, flags[0], f"not {flags[1]}"])
    return skill(name, *outcomes, precondition=precondition)


def _step(drawn: Random, name: str, handlers: Sequence[str]) -> Step:
    between, last = (drawn.choice([None, *handlers]) for _ in range(2))
    return Step(name, name, {}, {}, drawn.choice([0, 0, 1, 2]), between, last, SPAN)


def _part(drawn: Random, side: str, handlers: Sequence[str], depth: int) -> Part:
    one = _step(drawn, f"{side}_{drawn.randint(0, 2)}", handlers)
    if not depth:
        return one
    text = (_FLAGS if side == "left" else _OTHER_FLAGS)[0]
    match drawn.choice(["step", "seq", "if", "if", "any", "tolerate", "again", "check", "hold", "within"]):
        case "seq":
            return Seq(tuple(_part(drawn, side, handlers, depth - 1) for _ in range(2)))
        case "if":
            other = drawn.choice([None, _part(drawn, side, handlers, depth - 1)])
            return If(term(text), text, one, other, SPAN)
        case "any":
            return Fallback((_part(drawn, side, handlers, depth - 1), one), SPAN)
        case "tolerate":
            return Fallback((_part(drawn, side, handlers, depth - 1), Seq(())), SPAN)
        case "again":
            return RetriedPart(_part(drawn, side, handlers, depth - 1), 1, SPAN)
        case "hold":
            text = drawn.choice([text, f"not {text}", f"{text} and fill_level > 0.5"])
            parts = tuple(Conjunct(term(one), SPAN) for one in text.split(" and "))
            held = ActionCondition(term(text), text, SPAN, parts)
            return HeldPart(_part(drawn, side, handlers, depth - 1), SPAN, True, held)
        case "within":
            return TimedPart(_part(drawn, side, handlers, depth - 1), SPAN, True, Fraction(10))
        case "check":
            return Seq((one, If(term(text), text, Seq(()), FailingPart(text, SPAN), SPAN)))
        case _:
            return one
