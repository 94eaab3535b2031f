"""Small random tasks, odd ones included: plans that are rejected, recoveries that cannot start."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

from hypothesis import strategies as st

from aeros.spec.model.ecm import Ecm, Outcome, Skill, Task
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from tests.unit.agent import dumplings
from tests.unit.agent.dumplings import PREDICATES, given_input, module, site, skill, task

NAMES = PREDICATES[:3]
START: dict[str, Any] = {**dict.fromkeys(PREDICATES, False), "area": "table"}
_RANGE = (Fraction(0), Fraction(1))


@dataclass(frozen=True)
class Case:
    """A task to be predicted, and where it starts."""

    ecm: Ecm
    task: Task
    site: Site
    start: dict[str, Any]


_LITERALS = st.sampled_from([*NAMES, *(f"not {name}" for name in NAMES), "area == pot"])
_CONDITIONS = st.one_of(
    _LITERALS, st.builds("{} {} {}".format, _LITERALS, st.sampled_from(["and", "or"]), _LITERALS)
)
_EFFECTS = st.one_of(
    st.dictionaries(st.sampled_from(NAMES), st.booleans(), max_size=2),
    st.just({"area": "pot"}),
    st.just({"area": "table", NAMES[0]: True}),
)
_DEFAULTS: list[dict[str, Fraction | None]] = [{}, {}, {"force": Fraction(1, 2)}, {"force": None}]
_INPUTS = st.sampled_from(_DEFAULTS)
_PRECONDITIONS = st.one_of(st.none(), st.none(), _CONDITIONS)


@st.composite
def _skills(draw: st.DrawFn, name: str) -> Skill:
    effects = draw(st.lists(_EFFECTS, min_size=1, max_size=3))
    failures = draw(st.lists(st.booleans(), min_size=len(effects), max_size=len(effects)))
    weights = draw(st.lists(st.integers(0, 5), min_size=len(effects), max_size=len(effects)))
    silent = draw(st.booleans()) or not sum(weights)
    outcomes = [
        Outcome(
            f"outcome_{number}", effect, failure, None if silent else Fraction(weight, sum(weights)), None
        )
        for number, (effect, failure, weight) in enumerate(zip(effects, failures, weights, strict=True))
    ]
    if not silent and draw(st.booleans()):
        outcomes[-1] = replace(outcomes[-1], probability=None)
    inputs: dict[str, Declared] = {
        key: given_input(key, default, _RANGE) for key, default in draw(_INPUTS).items()
    }
    precondition = draw(_PRECONDITIONS)
    if draw(st.booleans()) and inputs:
        precondition = "inputs.force > 0.4" + (f" and ({precondition})" if precondition else "")
    return skill(name, *outcomes, precondition=precondition, inputs=inputs)


@st.composite
def cases(draw: st.DrawFn, *, most_rules: int, most_retries: int, most_replans: int) -> Case:
    """A module with one task and up to three skills."""
    names = [f"skill_{number}" for number in range(draw(st.integers(1, 3)))]
    skills = tuple(draw(_skills(name)) for name in names)
    rules = []
    for _ in range(draw(st.integers(1, most_rules))):
        run = draw(st.sampled_from(skills))
        rule = dumplings.rule(
            draw(_CONDITIONS),
            run.id,
            draw(st.integers(0, most_retries)),
            draw(st.one_of(st.none(), st.sampled_from(names))),
            draw(st.one_of(st.none(), st.none(), st.sampled_from(names))),
        )
        force = draw(st.sampled_from([Fraction(1, 4), Fraction(3, 4)]))
        rules.append(replace(rule, inputs={"force": force} if run.inputs else {}))
    pursued = task("task", ("word",), draw(_CONDITIONS), *rules)
    start = START | {name: draw(st.booleans()) for name in NAMES}
    return Case(
        module("small", skills, pursued), pursued, site(replans=draw(st.integers(0, most_replans))), start
    )


# Tasks in which it shows what a loop does: a start where something is to be done, plans that are seldom
# rejected, skills that only some turn of the loop runs, and marks that such a turn leaves behind.

_TARGETS, _MARKS = PREDICATES[:2], PREDICATES[2:]
_HARM: list[dict[str, Any]] = [
    {},
    *({name: True} for name in _MARKS),
    *({name: False} for name in PREDICATES),
    {"area": "pot"},
    {_TARGETS[0]: False, _MARKS[0]: True},
]
_LAST = st.sampled_from([None, None, "cure_0", "cure_1"])
_AT = ["area == table", "area == pot", *(f"not {name}" for name in PREDICATES), *PREDICATES]


@st.composite
def _turns(draw: st.DrawFn, name: str, target: str, needed: str) -> Skill:
    """A skill that brings its target about, or leaves a mark, and may undo what it or another needs."""
    undone: dict[str, Any] = {needed: False}
    more = [{needed: True}, undone, undone, undone | {target: True}]
    harm = st.sampled_from([*_HARM, *more * 3])
    outcomes = [Outcome("done", {target: True} | draw(st.just({}) | harm), False, None, None)]
    for number, effects in enumerate(draw(st.lists(harm, max_size=3))):
        outcomes.append(
            Outcome(f"failed_{number}", effects, draw(st.integers(0, 3)) > 0, None, None),
        )
    certain = draw(st.sampled_from([None] * 6 + [*range(len(outcomes))]))
    if certain is not None:
        impossible = draw(st.sampled_from([Fraction(0), None, None]))
        outcomes = [
            replace(one, probability=Fraction(1) if at == certain else impossible)
            for at, one in enumerate(outcomes)
        ]
    elif draw(st.integers(0, 3)) == 0:
        outcomes[-1] = replace(outcomes[-1], probability=Fraction(len(outcomes) == 1))
    outcomes = draw(st.permutations(outcomes))
    precondition = draw(st.sampled_from([*[None] * 4, *[needed] * 4, f"not {target}", *_AT[:2]]))
    inputs: dict[str, Declared] = {}
    if draw(st.integers(0, 2)) == 0:
        usual = draw(st.sampled_from([Fraction(1, 4), Fraction(1, 2), Fraction(1, 2)]))
        inputs["force"] = given_input("force", usual, _RANGE)
        precondition = "inputs.force > 0.4" + (f" and {precondition}" if precondition else "")
    return skill(name, *outcomes, precondition=precondition, inputs=inputs)


@st.composite
def loops(draw: st.DrawFn) -> Case:
    """A module with one task, which starts where all predicates are known and its goal is not reached."""
    targets = (*_TARGETS, _MARKS[0])
    steps = [draw(_turns(f"skill_{at}", name, targets[at - 1])) for at, name in enumerate(targets)]
    cures = [draw(_turns(f"cure_{at}", *draw(st.permutations(PREDICATES))[:2])) for at in range(2)]
    order = list(zip(steps, targets, strict=True))[: draw(st.integers(1, 3))]
    order = draw(st.sampled_from([order, order, draw(st.permutations(order))]))
    rules = []
    for run, target in order:
        unless = draw(st.sampled_from([target] * 3 + [f"{target} or {{}}", f"{target} and {{}}", "{}"]))
        cure = draw(st.sampled_from([None, cures[0].id, cures[0].id, cures[1].id]))
        done = unless.format(draw(st.sampled_from(_AT)))
        rule = dumplings.rule(done, run.id, draw(st.integers(0, 2)), cure, draw(_LAST))
        force = draw(st.sampled_from([Fraction(1, 4), Fraction(3, 4), Fraction(3, 4)]))
        rules.append(replace(rule, inputs={"force": force} if run.inputs else {}))
    last = order[-1][1]
    goal = draw(st.sampled_from([last, last, *targets, f"{last} and {targets[0]}", "area == pot"]))
    start = START | {name: draw(st.integers(0, 2)) == 0 and name not in goal for name in PREDICATES}
    pursued = replace(task("task", ("word",), goal, *rules), initial=start)
    skills = (*steps, *cures)
    limits = site(retries=draw(st.sampled_from([1, 2, 3, 3])), replans=0)
    return Case(module("small", skills, pursued), pursued, limits, start)


@st.composite
def marking_loops(draw: st.DrawFn) -> Case:
    """A task that shows how often a step is tried: each failure of it leaves a mark, and each plan begins
    with wiping them all away.
    """
    wiped = dict.fromkeys(_MARKS, False)
    tidy = skill("tidy", Outcome("tidied", wiped, False, None, None))
    marks = [Outcome(f"marked_{name}", {name: True}, True, None, None) for name in _MARKS]
    work = skill("work", Outcome("worked", {_TARGETS[0]: True}, False, None, None), *marks)
    cure = skill(
        "cure", Outcome("cured", draw(st.sampled_from([{}, {_TARGETS[1]: True}])), False, None, None)
    )
    rules = (
        dumplings.rule(" and ".join(f"not {name}" for name in _MARKS), "tidy"),
        dumplings.rule(
            _TARGETS[0],
            "work",
            draw(st.integers(0, 3)),
            draw(st.sampled_from([None, "cure"])),
            draw(st.sampled_from([None, None, "cure"])),
        ),
    )
    pursued = replace(task("task", ("word",), _TARGETS[0], *rules), initial=START)
    return Case(
        module("small", (tidy, work, cure), pursued), pursued, site(retries=3, replans=0), dict(START)
    )
