"""Claims about finite sets of a module against a walk over everything its skills do, one use at a time."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL
from aeros.spec.model.ecm import ActionCondition, Ecm, Outcome, Skill, Task
from aeros.spec.model.policy import Access, ModuleLimits, OperatorOverride
from aeros.spec.model.rules import ActionKind, Risk
from aeros.spec.model.site import Site
from aeros.spec.model.tools import Program, Tool
from aeros.spec.model.variables import Declared
from aeros.spec.obligations.permission import permission_obligations
from aeros.spec.obligations.verdicts import StaticClaim
from tests.hypothesis_profiles import examples
from tests.property.mix import Mix
from tests.property.test_verdicts import SPAN
from tests.unit.agent.dumplings import build

bounded = examples(200)

SENSOR_OF = {"seen": "eye", "heard": "ear", "known": None}
STATE = {
    name: Declared(t.Variable(name, BOOL, t.VariableRole.STATE), SPAN, sensor=sensor)
    for name, sensor in SENSOR_OF.items()
}
KINDS, ACTUATORS = ("push", "pull"), ("arm", "hand")


def _some(*names: str) -> st.SearchStrategy[frozenset[str]]:
    return st.frozensets(st.sampled_from(names))


ACCESS = st.builds(Access, _some(*ACTUATORS), _some("eye", "ear"), _some("net"), _some("gpu"))
READ = _some(*SENSOR_OF)
WORLDS = st.fixed_dictionaries(
    {
        "everyone": ACCESS,
        "granted": st.dictionaries(st.sampled_from(["module", "other"]), ACCESS),
        "asked": ACCESS,
        "kinds": st.fixed_dictionaries(
            {
                kind: st.tuples(_some(*ACTUATORS), st.sampled_from(Risk), st.sampled_from([None, "net"]))
                for kind in KINDS
            }
        ),
        "permitted": _some(*KINDS),
        "envelope": st.dictionaries(st.sampled_from(KINDS), READ),
        "moves": _some(*ACTUATORS),
        "holds": _some(*ACTUATORS),
        "counted": _some(*ACTUATORS),
        "risk": st.sampled_from(Risk),
        "ceiling": st.sampled_from(Risk),
        "start": READ,
        "effects": READ,
        "goal": READ,
        "blocks": st.lists(
            st.tuples(*(st.sampled_from([None, *some]) for some in (["module", "other"], ["skill"], KINDS))),
            max_size=2,
        ),
    }
)


def _reading(names: Iterable[str]) -> t.Term:
    return t.Or(tuple(STATE[name].variable for name in sorted(names)))


def _clause(names: Iterable[str]) -> ActionCondition:
    return ActionCondition(_reading(names), "", SPAN)


def _site(w: dict[str, Any]) -> Site:
    kinds = {
        name: ActionKind(
            name, moved, risk, False, {}, SPAN, Tool(Program(("ask",)), Fraction(1), (), channel)
        )
        for name, (moved, risk, channel) in w["kinds"].items()
    }
    blocks = tuple(OperatorOverride(f"b{number}", "", *who) for number, who in enumerate(w["blocks"]))
    return build(
        Site,
        state=STATE,
        kinds=kinds,
        access=w["everyone"],
        grants=w["granted"],
        risk_ceiling=w["ceiling"],
        limits=ModuleLimits(Fraction(1), 1, 1),
        blocks=blocks,
        resources=dict.fromkeys(w["counted"], 1),
        span=SPAN,
    )


def _module(w: dict[str, Any]) -> Ecm:
    skill = build(
        Skill,
        id="skill",
        precondition=_clause(w["start"]),
        outcomes={"done": Outcome("done", dict.fromkeys(w["effects"], True), False, None, None)},
        envelope={kind: _clause(read) for kind, read in w["envelope"].items()},
        actuators=w["moves"],
        resources=w["holds"],
        risk=w["risk"],
        timeout=Fraction(1),
    )
    return build(
        Ecm,
        id="module",
        skills={"skill": skill},
        tasks={"task": Task("task", (), _reading(w["goal"]), "", (), {}, None, SPAN)},
        requested_access=w["asked"],
        permitted_actions={kind: _clause(()) for kind in w["permitted"]},
    )


SEEN = Mix()


def test_every_use_that_is_not_permitted_is_refused_and_nothing_else() -> None:
    _uses_are_judged()
    SEEN.assert_both("AE401", "AE402", "AE404", "AE405", "AE406", "AE407", "AE408", "AE410", "AE411")


@bounded
@given(WORLDS)
def _uses_are_judged(w: dict[str, Any]) -> None:
    settled = [one for one in permission_obligations(_module(w), _site(w)) if isinstance(one, StaticClaim)]
    found = {str(one.id): one for one in settled}
    assert len(found) == len(settled)

    def judge(code: str, claim: str, expected: bool) -> None:
        diagnostic = found.pop(f"permission/{claim}").diagnostic
        assert diagnostic is None or diagnostic.code == code
        SEEN.compare(code, proved=diagnostic is None, expected=expected)

    mine = w["granted"].get("module", Access())
    for group in ("actuators", "sensors", "channels", "compute"):
        for_anyone, for_it = getattr(w["everyone"], group), getattr(mine, group)
        asked = getattr(w["asked"], group)
        judge("AE404", f"access/{group}", all(one in for_anyone or one in for_it for one in asked))
    for kind in w["envelope"]:
        moved, _, channel = w["kinds"][kind]
        judge("AE402", f"skill/{kind}/actuators", all(one in w["moves"] for one in moved))
        if channel is not None:
            judge("AE411", f"skill/{kind}/channels", channel in w["asked"].channels)
        if kind in w["permitted"]:
            SEEN.compare("AE401", proved=f"permission/skill/{kind}" not in found, expected=True)
        else:
            judge("AE401", f"skill/{kind}", expected=False)
    judge("AE402", "skill/actuators", all(one in w["asked"].actuators for one in w["moves"]))
    judge("AE410", "skill/held", all(one in w["holds"] for one in w["moves"] if one in w["counted"]))
    riskiest = max((w["kinds"][kind][1].value for kind in w["envelope"]), default=0)
    judge("AE406", "skill/risk-ceiling", w["risk"].value <= w["ceiling"].value)
    judge("AE407", "skill/risk-stated", riskiest <= w["risk"].value)
    read = {name for names in w["envelope"].values() for name in names} | w["start"] | w["effects"]
    for claim, names in (("skill/sensors", read), ("task/task/sensors", w["goal"])):
        sensors = {SENSOR_OF[name] for name in names} - {None}
        judge("AE405", claim, all(sensor in w["asked"].sensors for sensor in sensors))
    for number, (module, skill, action) in enumerate(w["blocks"]):
        hits = [
            kind
            for kind in w["envelope"]
            if module in (None, "module") and skill in (None, "skill") and action in (None, kind)
        ]
        judge("AE408", f"unblocked/b{number}", not hits)
    assert not found
