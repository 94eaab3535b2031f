"""Verdicts against enumeration: no false PROVED, no false REFUTED, VACUOUS exactly for empty claims.

Variables are booleans, enum members, families of booleans and two reals in [-1, 1].  Real terms are
built from the reals, their negations and magnitudes, -1, 0 and 1 by minimum, maximum and choice, so
the truth of a condition depends only on how ±x, ±y, -1, 0 and 1 are ordered.  Thirds give every such
order: two different values lie inside each unit interval, and their mirror images inside the other.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any, cast

from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.diagnostics.codes import SpanLabel
from aeros.spec.diagnostics.source import Source
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import Environment, Value, evaluate, is_true
from aeros.spec.expr.types import BOOL, EnumType, FamilyType, RealType
from aeros.spec.expr.units import NUMBER
from aeros.spec.model.ecm import ActionCondition, Ecm, Outcome, Skill, Task
from aeros.spec.model.policy import Access, ModuleLimits, OperatorOverride
from aeros.spec.model.rules import ActionKind, Conjunct, Risk, Rule
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.obligation import ClaimMode, Obligation, VariableSpace
from aeros.spec.obligations.permission import permission_obligations
from aeros.spec.obligations.policy import policy_obligations
from aeros.spec.obligations.safety import safety_obligations
from aeros.spec.obligations.verdicts import StaticClaim, Verdict
from aeros.spec.verification.discharge import ObligationResult, discharge_obligations
from tests.hypothesis_profiles import examples
from tests.property.mix import Mix

bounded = examples(90)

SPAN = Source("generated", "x").span(0, 1)
COLOURS = EnumType("colours", ("red", "green", "blue"))
SIDES = EnumType("sides", ("left", "right"))
REAL = RealType(NUMBER)
UNIT = (Fraction(-1), Fraction(1))
GRID = tuple(Fraction(third, 3) for third in range(-3, 4))


def _declared(name: str, type_: Any, role: t.VariableRole) -> Declared:
    return Declared(t.Variable(name, type_, role), SPAN, range=UNIT if type_ == REAL else None, sensor="eye")


STATE = {
    one.name: one
    for one in (
        _declared("flag", BOOL, t.VariableRole.STATE),
        _declared("x", REAL, t.VariableRole.STATE),
        _declared("open", FamilyType(SIDES, BOOL), t.VariableRole.STATE),
    )
}
PARAMETERS = {
    one.name: one
    for one in (
        _declared("y", REAL, t.VariableRole.PARAMETER),
        _declared("colour", COLOURS, t.VariableRole.PARAMETER),
    )
}
INPUTS = {"gently": _declared("inputs.gently", BOOL, t.VariableRole.INPUT)}
EVERYTHING = (*STATE.values(), *PARAMETERS.values(), *INPUTS.values())


def _values(one: Declared) -> tuple[Value, ...]:
    match one.variable.type:
        case EnumType(members=members):
            return members
        case FamilyType(index=index):
            return tuple(itertools.product((False, True), repeat=len(index.members)))
        case RealType():
            return GRID
        case _:
            return (False, True)


def environments(*terms: t.Term) -> Iterator[Environment]:
    """Every combination of values of the variables that `terms` mention."""
    mentioned = {name for term in terms for name in t.variables_of(term)}
    declared = [one for one in EVERYTHING if one.name in mentioned]
    for values in itertools.product(*map(_values, declared)):
        yield {one.name: value for one, value in zip(declared, values, strict=True)}


def possible(*terms: t.Term) -> bool:
    """Return true if all `terms` hold somewhere."""
    return any(all(is_true(term, env) for term in terms) for env in environments(*terms))


def state_matters(rule: t.Term) -> bool:
    """Return true if some action is allowed by `rule` in one state and denied in another.

    For halves as values of y, the quarters hold one x of every order among x, y, -y, -1, 0 and 1.
    """
    finer: Mapping[str, Sequence[Value]] = {
        "x": [Fraction(n, 4) for n in range(-4, 5)],
        "y": [Fraction(n, 2) for n in range(-2, 3)],
    }
    mentioned = [one for one in EVERYTHING if one.name in t.variables_of(rule)]
    values = {one.name: finer.get(one.name) or _values(one) for one in mentioned}
    measured = [one.name for one in mentioned if one.variable.role is t.VariableRole.STATE]
    asked = [name for name in values if name not in measured]
    return any(
        len(
            {
                is_true(
                    rule, {**dict(zip(asked, action, strict=True)), **dict(zip(measured, state, strict=True))}
                )
                for state in itertools.product(*(values[name] for name in measured))
            }
        )
        == 2
        for action in itertools.product(*(values[name] for name in asked))
    )


def conditions(*roles: t.VariableRole) -> st.SearchStrategy[t.Term]:
    """Conditions over the variables of `roles`."""
    mine = {one.name: one.variable for one in EVERYTHING if one.variable.role in roles}
    minus = t.Literal(Fraction(-1), REAL)
    atoms: list[t.Term] = [t.Literal(Fraction(value), REAL) for value in (-1, 0, 1)]
    for name in mine.keys() & {"x", "y"}:
        atoms += [mine[name], t.Absolute(mine[name]), t.Multiply(minus, mine[name])]
    reals = st.sampled_from(sorted(atoms, key=repr))
    truths: list[st.SearchStrategy[t.Term]] = [st.sampled_from([t.TRUE, t.FALSE])]
    truths += [st.just(mine[name]) for name in ("flag", "inputs.gently") if name in mine]
    if "colour" in mine:
        members = st.sampled_from([t.Literal(member, COLOURS) for member in COLOURS.members])
        truths.append(members.map(lambda member: t.Compare("==", mine["colour"], member)))
    if "open" in mine:
        side = t.BoundVariable("side", SIDES)
        each = t.Select(mine["open"], side)
        truths.append(st.sampled_from([t.Quantified("all", side, each), t.Quantified("any", side, each)]))
        truths.append(st.just(t.Select(mine["open"], t.Literal("left", SIDES))))
    choices = st.builds(t.Conditional, st.one_of(truths), reals, reals)
    extrema = st.builds(t.Extremum, st.sampled_from(["min", "max"]), reals, st.one_of(reals, choices))
    numbers = st.one_of(reals, reals, choices, extrema)
    comparisons = st.builds(t.Compare, st.sampled_from(["<", "<=", "=="]), numbers, numbers)
    leaves = st.one_of(comparisons, comparisons, *truths)
    return st.recursive(
        leaves,
        lambda inner: st.one_of(
            st.builds(t.Not, inner),
            st.builds(t.Implies, inner, inner),
            st.builds(lambda a, b: t.And((a, b)), inner, inner),
            st.builds(lambda a, b: t.Or((a, b)), inner, inner),
        ),
        max_leaves=5,
    )


ANY = conditions(*t.VariableRole)


@bounded
@given(
    st.lists(ANY, max_size=2),
    ANY,
    st.sampled_from(ClaimMode),
    st.sampled_from([Verdict.REFUTED, Verdict.VACUOUS]),
)
def test_the_verdict_is_what_enumeration_finds(
    assumptions: list[t.Term], conclusion: t.Term, claim: ClaimMode, failing: Verdict
) -> None:
    space = VariableSpace(EVERYTHING, tuple(assumptions))
    label = SpanLabel(SPAN)
    (found,) = discharge_obligations(
        [
            Obligation(
                ClaimForm.SKILL_CAN_START("i"),
                "AE501",
                claim,
                space,
                conclusion,
                "h",
                label,
                failure_verdict=failing,
            )
        ]
    )
    if claim is ClaimMode.ALWAYS:
        expected = Verdict.REFUTED if possible(*assumptions, t.Not(conclusion)) else Verdict.PROVED
    else:
        expected = Verdict.PROVED if possible(*assumptions, conclusion) else failing
    assert found.verdict is expected
    _replays(found)


def _replays(found: ObligationResult) -> None:
    if found.witness is None:
        return
    one, env = found.obligation, found.witness.values
    assert all(is_true(term, env) for term in one.space.assumptions)
    assert is_true(one.conclusion, env) is (one.mode is ClaimMode.SOMETIMES)


# Whole sites and modules: what their obligations say is compared with what the words of the claims say.


def _site(rules: list[t.Term], reduced: t.Term) -> Site:
    kind = ActionKind("move", frozenset(), Risk.LOW, False, PARAMETERS, SPAN)
    phi = tuple(
        Rule(f"r{i}", "", "", "", {"move": rule}, {"move": {"y": reduced}} if i == 0 else {}, SPAN, SPAN)
        for i, rule in enumerate(rules)
    )
    access = Access(sensors=frozenset(["eye"]))
    limits = ModuleLimits(Fraction(1), 1, 1)
    enums = {"colours": COLOURS, "sides": SIDES}
    kinds = {"move": kind}
    return Site(
        id="site", digest="", enums=enums, constants={}, volumes={}, state=STATE, kinds=kinds, rules=phi,
        access=access, grants={}, risk_ceiling=Risk.LOW, limits=limits, blocks=(), quotas=(), resources={},
        span=SPAN,
    )  # fmt: skip


def _module(
    envelope: t.Term, permission: t.Term, gated: list[str], precondition: t.Term, goal: t.Term
) -> Ecm:
    start = ActionCondition(precondition, "", SPAN)
    skill = Skill(
        id="skill", module_name="", function="", inputs=INPUTS, precondition=start, outcomes={},
        envelope={"move": ActionCondition(envelope, "", SPAN)}, actuators=frozenset(), resources=frozenset(),
        risk=Risk.LOW, timeout=Fraction(1), runtime_checked=dict.fromkeys(gated, SPAN),
        span=SPAN, risk_span=SPAN, entry_span=SPAN,
    )  # fmt: skip
    return Ecm(
        id="module", version="1", folder="", manifest_digest="", code_digest="", capabilities={},
        skills={"skill": skill}, tasks={"task": Task("task", (), goal, "", (), {}, None, SPAN)},
        requested_access=Access(sensors=frozenset(["eye"])),
        permitted_actions={"move": ActionCondition(permission, "", SPAN)}, required_modules={},
        requires_spans={}, required_aeros_version="",
        runtime_span=SPAN, access_span=SPAN, span=SPAN,
    )  # fmt: skip


def _findings(claims: Iterator[Any]) -> dict[str, ObligationResult]:
    return {
        str(one.obligation.id): one
        for one in discharge_obligations([c for c in claims if isinstance(c, Obligation)])
    }


ON_ACTIONS = conditions(t.VariableRole.STATE, t.VariableRole.PARAMETER)
Y = PARAMETERS["y"].variable
REDUCED = st.sampled_from(
    [
        Y,
        t.Literal(Fraction(0), REAL),
        t.Multiply(t.Literal(Fraction(-1), REAL), Y),
        t.Extremum("min", Y, t.Literal(Fraction(0), REAL)),
        t.Extremum("max", Y, t.Literal(Fraction(0), REAL)),
        t.Extremum("max", Y, STATE["x"].variable),
    ]
)


POLICIES, STOPS, MODULES = Mix(), Mix(), Mix()


def test_a_policy_is_refused_exactly_where_its_words_say_so() -> None:
    _policy_is_judged_by_its_words()
    POLICIES.assert_both("AE601", "AE603", "AE604", "AE605", "AE606")


@bounded
@given(st.lists(ON_ACTIONS, min_size=1, max_size=3), REDUCED)
def _policy_is_judged_by_its_words(rules: list[t.Term], reduced: t.Term) -> None:
    found = _findings(policy_obligations(_site(rules, reduced)))
    everything = [*rules, reduced, Y]
    space = list(environments(*everything))
    allowed = [env for env in space if all(is_true(rule, env) for rule in rules)]

    def judge(code: str, claim: str, expected: bool) -> None:
        one = found[f"policy/move/{claim}"]
        assert one.obligation.code == code
        assert one.verdict in (Verdict.PROVED, one.obligation.failure_verdict)
        POLICIES.compare(code, proved=one.verdict is Verdict.PROVED, expected=expected)

    judge("AE601", "satisfiable", bool(allowed))
    for i, rule in enumerate(rules):
        others = rules[:i] + rules[i + 1 :]
        denied = [env for env in space if not is_true(rule, env)]
        alone = [env for env in denied if all(is_true(other, env) for other in others)]
        judge("AE603", f"effective/r{i}", bool(denied))
        judge("AE604", f"unshadowed/r{i}", bool(alone))
        if i == 0:
            after = [{**env, "y": _number(reduced, env)} for env in alone]
            kept = all(is_true(one, env) for env in after for one in rules)
            pairs = [(_number(Y, env), _number(Y, old)) for env, old in zip(after, alone, strict=True)]
            smaller = all(0 <= new <= old or old <= new <= 0 for new, old in pairs)
            judge("AE605", "attenuation-allowed/r0", kept)
            judge("AE606", "attenuation-shrinks/r0", smaller)
    for one in found.values():
        _replays(one)


def _number(term: t.Term, env: Environment) -> Fraction:
    return cast("Fraction", evaluate(term, env))


def test_the_stop_is_refused_exactly_where_something_denies_it() -> None:
    _stop_is_judged()
    STOPS.assert_both("AE602")


ON_STATES = conditions(t.VariableRole.STATE)


@bounded
@given(
    st.lists(st.one_of(st.just(t.TRUE), ON_STATES), max_size=2),
    st.lists(st.sampled_from(["stop", "move", None]), max_size=2),
)
def _stop_is_judged(rules: list[t.Term], blocked: list[str | None]) -> None:
    site = _site([], Y)
    stop = ActionKind("stop", frozenset(), Risk.LOW, True, {}, SPAN)
    phi = tuple(Rule(f"r{i}", "", "", "", {"stop": rule}, {}, SPAN, SPAN) for i, rule in enumerate(rules))
    blocks = tuple(OperatorOverride(f"b{i}", "", "module", None, action) for i, action in enumerate(blocked))
    site = replace(site, kinds={"stop": stop}, rules=phi, blocks=blocks)
    claims = list(policy_obligations(site))
    found = _findings(iter(claims))
    for i, rule in enumerate(rules):
        verdict = found[f"policy/stop/allowed/r{i}"].verdict
        always = all(is_true(rule, env) for env in environments(rule))
        STOPS.compare("AE602", proved=verdict is Verdict.PROVED, expected=always)
    settled = {str(one.id): one.verdict for one in claims if isinstance(one, StaticClaim)}
    for i, action in enumerate(blocked):
        verdict = settled[f"policy/stop/unblocked/b{i}"]
        STOPS.compare("AE602", proved=verdict is Verdict.PROVED, expected=action != "stop")


def test_a_module_is_refused_exactly_where_its_words_say_so() -> None:
    _module_is_judged_by_its_words()
    MODULES.assert_both(
        "AE403", "AE409", "AE501", "AE502", "AE503", "AE504", "AE506", "AE507", "AE508", "guarded"
    )


@bounded
@given(
    st.lists(ON_ACTIONS, min_size=1, max_size=2),
    ANY,
    ON_ACTIONS,
    st.lists(st.sampled_from(["r0", "r1"]), unique=True),
    conditions(t.VariableRole.STATE, t.VariableRole.INPUT),
    ON_STATES,
)
def _module_is_judged_by_its_words(
    rules: list[t.Term],
    envelope: t.Term,
    permission: t.Term,
    gated: list[str],
    precondition: t.Term,
    goal: t.Term,
) -> None:
    site, module = _site(rules, Y), _module(envelope, permission, gated, precondition, goal)
    claims = [*permission_obligations(module, site), *safety_obligations(module, site)]
    found = _findings(iter(claims))
    space = [env for env in environments(envelope, permission, *rules) if is_true(envelope, env)]

    def judge(code: str, claim: str, expected: bool) -> None:
        one = found[claim]
        assert one.obligation.code == code
        assert one.verdict in (Verdict.PROVED, one.obligation.failure_verdict)
        MODULES.compare(code, proved=one.verdict is Verdict.PROVED, expected=expected)

    judge("AE503", "safety/skill/move/not-empty", bool(space))
    permitted = [env for env in space if is_true(permission, env)]
    judge("AE403", "permission/skill/move", len(permitted) == len(space))
    judge("AE409", "permission/move/not-empty", possible(permission))
    judge(
        "AE502", "safety/skill/move/not-dead", any(all(is_true(r, env) for r in rules) for env in permitted)
    )
    roles = [{variable.role for variable in t.variables_of(rule).values()} for rule in rules]
    for i, rule in enumerate(rules):
        judge("AE501", f"safety/skill/move/r{i}", all(is_true(rule, env) for env in space))
        one = found[f"safety/skill/move/r{i}"]
        left = t.VariableRole.STATE in roles[i] and (
            t.VariableRole.PARAMETER not in roles[i] or f"r{i}" in gated
        )
        expected = left and one.verdict is Verdict.REFUTED
        MODULES.compare("guarded", proved=one.is_runtime_checked, expected=expected)
    settled = {str(one.id): one.verdict for one in claims if isinstance(one, StaticClaim)}
    for i in (i for i in range(len(rules)) if f"r{i}" in gated):
        if t.VariableRole.STATE in roles[i]:
            judge("AE506", f"safety/skill/gated-r{i}/move", state_matters(rules[i]))
        else:
            MODULES.compare("AE506", proved=f"safety/skill/gated-r{i}" not in settled, expected=False)
    # What no action can help: rules that read the state and nothing of the action.
    of_states = [rule for rule, read in zip(rules, roles, strict=True) if read == {t.VariableRole.STATE}]
    judge("AE504", "safety/skill/can-start", possible(precondition, *of_states))
    judge("AE507", "safety/goal/task", possible(goal))
    judge("AE508", "safety/goal/task/effective", possible(t.Not(goal)))
    for one in found.values():
        _replays(one)


HOLDS = Mix()


def test_a_hold_condition_is_refused_exactly_where_it_leaves_no_room() -> None:
    _hold_is_judged_by_its_words()
    HOLDS.assert_both("AE510")


@bounded
@given(
    st.lists(ON_STATES, max_size=2),
    conditions(t.VariableRole.STATE, t.VariableRole.INPUT),
    conditions(t.VariableRole.STATE, t.VariableRole.INPUT),
    st.booleans(),
)
def _hold_is_judged_by_its_words(
    rules: list[t.Term], precondition: t.Term, hold: t.Term, value: bool
) -> None:
    module = _module(t.TRUE, t.TRUE, [], precondition, t.TRUE)
    clause = ActionCondition(hold, "", SPAN, (Conjunct(hold, SPAN),))
    done = Outcome("done", {"flag": value}, False, None, None)
    skill = replace(module.skills["skill"], hold_condition=clause, outcomes={"done": done})
    claims = safety_obligations(replace(module, skills={"skill": skill}), _site(rules, Y))
    found = _findings(claims)
    of_states = [rule for rule in rules if t.variables_of(rule)]
    flag = STATE["flag"].variable
    set_ = flag if value else t.Not(flag)
    expected = {"safety/skill/hold": possible(precondition, hold, *of_states)}
    if flag.name in t.variables_of(hold):
        expected["safety/skill/hold/done"] = possible(hold, set_)
    assert {name for name in found if name.startswith("safety/skill/hold")} == set(expected)
    for name, holds_somewhere in expected.items():
        one = found[name]
        assert one.obligation.code == "AE510"
        HOLDS.compare("AE510", proved=one.verdict is Verdict.PROVED, expected=holds_somewhere)
        _replays(one)
