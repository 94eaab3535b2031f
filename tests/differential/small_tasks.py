"""Small random tasks, odd ones included: plans that are rejected, recoveries that cannot start."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

from hypothesis import strategies as st

from aeros.spec.model import Declared, Ecm, Outcome, Site, Skill, Task
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
        )
        force = draw(st.sampled_from([Fraction(1, 4), Fraction(3, 4)]))
        rules.append(replace(rule, inputs={"force": force} if run.inputs else {}))
    pursued = task("task", ("word",), draw(_CONDITIONS), *rules)
    start = START | {name: draw(st.booleans()) for name in NAMES}
    return Case(
        module("small", skills, pursued), pursued, site(replans=draw(st.integers(0, most_replans))), start
    )
