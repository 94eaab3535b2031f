"""Claims about compositions against a small-step interpreter that tries every start and every interleaving.

The interpreter knows nothing of situations: it runs the graph from each state, one event after the
other, where a skill starts and ends at different times and other branches run in between.  p, q and r are
predicates; v is measured, and may be anything once a skill has run, and at any time beside a branch.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.agent.planning.compositions import composition_to_graph
from aeros.agent.planning.task_graph import verify_plan
from aeros.spec.diagnostics.source import Source, SourceSpan
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import is_true
from aeros.spec.expr.types import BOOL, RealType
from aeros.spec.expr.units import NUMBER
from aeros.spec.flow import symbolic_paths
from aeros.spec.model.composition import Composition, Part, Step, nested
from aeros.spec.model.ecm import ActionCondition, CapabilityInterface, Ecm, Outcome, Skill
from aeros.spec.model.policy import Access, ModuleLimits
from aeros.spec.model.rules import ActionKind, JointRule, Risk, Rule
from aeros.spec.model.site import Site
from aeros.spec.model.step_graph import (
    FailingPart,
    Fallback,
    HeldPart,
    If,
    Par,
    RetriedPart,
    Seq,
    StoppablePart,
    TimedPart,
    children_of,
    steps_of,
    walk_parts,
)
from aeros.spec.model.variables import Declared
from aeros.spec.obligations import joint
from aeros.spec.obligations.composition import composition_obligations
from aeros.spec.obligations.interfaces import interface_obligations
from aeros.spec.obligations.joint import joint_policy_obligations
from aeros.spec.obligations.obligation import Obligation
from aeros.spec.obligations.verdicts import StaticClaim, Verdict
from aeros.spec.verification.discharge import discharge_obligations
from tests.hypothesis_profiles import examples
from tests.property.mix import Mix

bounded = examples(130, report_multiple_bugs=False)

TEXT = Source("generated", "x" * 1000)
NAMES = ("p", "q", "r")
REAL = RealType(NUMBER)
UNIT = (Fraction(0), Fraction(1))
STATE = {name: Declared(t.Variable(name, BOOL, t.VariableRole.STATE), TEXT.span(0, 1)) for name in NAMES}
STATE["v"] = Declared(t.Variable("v", REAL, t.VariableRole.STATE), TEXT.span(0, 1), range=UNIT)
STATES: list[dict[str, Any]] = [
    dict(zip(STATE, values, strict=True)) for values in itertools.product(*[(False, True)] * 3, UNIT)
]
V = t.Compare("<=", STATE["v"].variable, t.Literal(Fraction(0), REAL))
P, Q, R = (STATE[name].variable for name in NAMES)
CONDITIONS: list[t.Term] = [
    *(P, Q, R),
    *(t.Not(P), t.Not(Q), t.TRUE, t.And((P, Q)), t.Or((P, t.Not(R))), t.Compare("==", Q, R)),
    *(V, t.Not(V)),
]


def _site(**changes: Any) -> Site:
    given: dict[str, Any] = dict(  # noqa: C408 - reads as the call below
        id="site", digest="", enums={}, constants={}, volumes={}, state=STATE, kinds={}, rules=(),
        access=Access(), grants={}, risk_ceiling=Risk.LOW, limits=ModuleLimits(Fraction(1), 2, 1), blocks=(),
        quotas=(), resources={"arm": 1, "camera": 2}, span=TEXT.span(0, 1),
    )  # fmt: skip
    return Site(**given | changes)


def _skill(name: str, precondition: t.Term | None, outcomes: list[Outcome], **changes: Any) -> Skill:
    clause = None if precondition is None else ActionCondition(precondition, "", TEXT.span(0, 1))
    given: dict[str, Any] = dict(  # noqa: C408 - reads as the call below
        id=name, module_name="", function="", inputs={}, precondition=clause,
        outcomes={one.id: one for one in outcomes}, envelope={}, actuators=frozenset(),
        resources=frozenset(), risk=Risk.LOW, timeout=Fraction(1), runtime_checked={}, span=TEXT.span(0, 1),
        risk_span=TEXT.span(0, 1), entry_span=TEXT.span(0, 1),
    )  # fmt: skip
    return Skill(**given | changes)


def _module(skills: dict[str, Skill], composition: Composition) -> Ecm:
    return Ecm(
        id="module", version="1", folder="", manifest_digest="", code_digest="", capabilities={},
        skills=skills, tasks={}, requested_access=Access(), permitted_actions={}, required_modules={},
        requires_spans={}, required_aeros_version="",
        runtime_span=TEXT.span(0, 1), access_span=TEXT.span(0, 1), span=TEXT.span(0, 1),
        compositions={composition.id: composition},
    )  # fmt: skip


_EFFECTS = st.dictionaries(st.sampled_from([*NAMES, *NAMES, "v"]), st.booleans(), max_size=2)


@st.composite
def _skills(draw: st.DrawFn) -> dict[str, Skill]:
    found = {}
    for name in ("s0", "s1", "s2", "s3"):
        precondition = draw(st.one_of(st.none(), st.sampled_from(CONDITIONS)))
        outcomes = []
        for number in range(draw(st.integers(1, 3))):
            probability = draw(st.sampled_from([None, None, None, Fraction(0)])) if number else None
            # One that is declared impossible may be measured where its effects hold already.
            drawn = {} if probability == 0 else draw(_EFFECTS)
            effects = {name: (UNIT[value] if name == "v" else value) for name, value in drawn.items()}
            failure = number > 0 and draw(st.booleans())
            outcomes.append(Outcome(f"o{number}", effects, failure, probability, None))
        resources = draw(st.frozensets(st.sampled_from(["arm", "camera"]), max_size=1))
        found[name] = _skill(name, precondition, outcomes, resources=resources)
    return found


class _Drawer:
    def __init__(self, draw: st.DrawFn, pars_anywhere: bool = False, has_stops: bool = False) -> None:
        self.has_stops = has_stops
        self.draw = draw
        self.pars_anywhere = pars_anywhere
        self.par_may_fail = True
        self.number = 0

    def span(self) -> SourceSpan:
        self.number += 1
        return TEXT.span(self.number, self.number + 1)

    def step(self) -> Step:
        retry = self.draw(st.sampled_from([0, 0, 1, 2]))
        handler = self.draw(st.sampled_from([None, "h0", "h1"])) if retry else None
        last = self.draw(st.sampled_from([None, None, "stop", "h0", "h1"]))
        span = self.span()
        skill = self.draw(st.sampled_from(["s0", "s1", "s2", "s3"]))
        return Step(f"step{self.number}", skill, {}, {}, retry, handler, last, span)

    def part(self, depth: int) -> Part:
        forms = ["step", "seq", "seq", "seq", "if", "if", "if", "any", "tolerate", "again", "check"]
        forms += ["hold", "hold", "within", "within"] if self.has_stops else []
        forms += ["par", "par"] if self.par_may_fail else []
        form = self.draw(st.sampled_from(forms)) if depth else "step"
        if form == "step":
            return self.step()
        if form == "check":
            return If(
                self.draw(st.sampled_from(CONDITIONS)),
                "",
                Seq(()),
                FailingPart("v", self.span()),
                self.span(),
            )
        if form in ("any", "tolerate", "again"):
            return self.alternatives(form, depth)
        if form in ("hold", "within"):
            return self.stoppable(form, depth)
        if form == "if":
            otherwise = self.draw(st.sampled_from(["part", "nothing", "none"]))
            condition, then = self.draw(st.sampled_from(CONDITIONS)), self.part(depth - 1)
            other = self.part(depth - 1) if otherwise == "part" else Seq(())
            return If(condition, "", then, None if otherwise == "none" else other, self.span())
        inner = tuple(
            self.part(depth - 1) for _ in range(self.draw(st.integers(2, 3 if form == "seq" else 2)))
        )
        if form == "par":  # the manifest refuses a branch without a step
            return Par(tuple(one if any(steps_of(one)) else self.step() for one in inner), self.span())
        return Seq(inner)

    def stoppable(self, form: str, depth: int) -> Part:
        """Draw a part that may be stopped; no `par` is in it, unless any may be."""
        outer, self.par_may_fail = self.par_may_fail, self.pars_anywhere
        inner = self.part(depth - 1)
        inner = inner if any(steps_of(inner)) else Seq((inner, self.step()))
        self.par_may_fail = outer
        if form == "within":
            return TimedPart(inner, self.span(), True, Fraction(1))
        condition = ActionCondition(self.draw(st.sampled_from(CONDITIONS)), "", self.span())
        return HeldPart(inner, self.span(), True, condition)

    def alternatives(self, form: str, depth: int) -> Part:
        """Draw a part that goes on after a failure; no `par` in it fails, unless any may."""
        outer, self.par_may_fail = self.par_may_fail, self.pars_anywhere
        first = self.part(depth - 1)
        if form == "again":
            made: Part = RetriedPart(first, self.draw(st.integers(1, 2)), self.span())
        elif form == "tolerate":
            made = Fallback((first, Seq(())), self.span())
        else:
            made = Fallback((first, self.part(depth - 1)), self.span())
        self.par_may_fail = outer
        return made


@st.composite
def _compositions(draw: st.DrawFn, pars_anywhere: bool = False, has_stops: bool = False) -> Composition:
    drawer = _Drawer(draw, pars_anywhere, has_stops)
    body = drawer.part(2)
    if has_stops and draw(st.booleans()):
        body = Seq((body, drawer.stoppable(draw(st.sampled_from(["hold", "within"])), 2)))
    body = body if any(steps_of(body)) else Seq((body, drawer.step()))
    second = Step("h1", draw(st.sampled_from(["s0", "s1"])), {}, {}, 0, None, None, drawer.span())
    first = Step("h0", draw(st.sampled_from(["s2", "s3"])), {}, {}, 1, "h1", None, drawer.span())
    precondition = draw(st.sampled_from([t.TRUE, *CONDITIONS]))
    span = None if precondition == t.TRUE else drawer.span()
    return Composition("c", precondition, span, body, {"h0": first, "h1": second}, drawer.span())


# The interpreter.  A process is what is still to be done: a nested tuple, or "done" or "stopped".

Process = Any


class _Machine:
    """Runs every process from every state; what it meets is compared with the claims."""

    def __init__(self, composition: Composition, skills: dict[str, Skill]) -> None:
        self.handlers = composition.handlers
        self.skills = skills
        self.started: set[str] = set()
        self.unready: set[str] = set()
        self.uncovered: set[int] = set()
        self.succeeded: set[int] = set()
        self.final_states: list[dict[str, Any]] = []
        starts = [state for state in STATES if is_true(composition.precondition, state)]
        pending = [(self.begin(composition.body), tuple(start.items())) for start in starts]
        seen = set(map(repr, pending))
        while pending:
            process, state = pending.pop()
            if process == "done":
                self.final_states.append(dict(state))
            for following in self.next(process, dict(state)):
                later = (following[0], tuple(following[1].items()))
                if repr(later) not in seen:
                    seen.add(repr(later))
                    pending.append(later)

    def begin(self, part: Part) -> Process:
        match part:
            case Step():
                return ("try", part, part.id, part.retry)
            case Seq(parts=inner):
                return ("seq", tuple(self.begin(one) for one in inner))
            case Par(branches=inner):
                return ("par", tuple(self.begin(one) for one in inner))
            case If():
                return ("if", part)
            case Fallback(parts=(first, *others)):
                return ("any", self.begin(first), tuple(others))
            case RetriedPart(part=one, retry=retry):
                return ("any", self.begin(one), (one,) * retry)
            case HeldPart(part=one) | TimedPart(part=one):
                return ("begin", part, self.begin(one))
            case _:
                return ("fail",)

    def next(self, process: Process, state: dict[str, Any]) -> Iterator[tuple[Process, dict[str, Any]]]:
        match process:
            case ("seq", ()):
                yield "done", state
            case ("seq", (first, *others)):
                for after, changed in self.next(first, state):
                    if after == "done":
                        yield ("seq", tuple(others)), changed
                    else:
                        yield ("stopped" if after == "stopped" else ("seq", (after, *others))), changed
                if first == "done":
                    yield ("seq", tuple(others)), state
            case ("par", branches):
                if all(one in ("done", "stopped") for one in branches):
                    yield ("stopped" if "stopped" in branches else "done"), state
                for index, branch in enumerate(branches):
                    for after, changed in self.next(branch, state):
                        for measured in UNIT:
                            rest = (*branches[:index], after, *branches[index + 1 :])
                            yield ("par", rest), {**changed, "v": measured}
            case ("if", part):
                if is_true(part.condition, state):
                    yield self.begin(part.then), state
                elif part.otherwise is None:
                    self.uncovered.add(part.span.start)
                    yield ("stuck",), state  # no declared failure, so no alternative follows
                else:
                    yield self.begin(part.otherwise), state
            case ("any", "done", _):
                yield "done", state
            case ("any", first, others):
                for after, changed in self.next(first, state):
                    if after != "stopped":
                        yield ("any", after, others), changed
                    else:
                        yield ("any", self.begin(others[0]), others[1:]) if others else after, changed
            case ("begin", part, inner):
                begins = isinstance(part, TimedPart) or is_true(part.condition.term, state)
                yield ("while", part, inner) if begins else "stopped", state
            case ("while", part, inner):
                condition = None if isinstance(part, TimedPart) else part.condition.term
                yield from self.stopped(condition, state)
                for after, changed in self.next(inner, state):
                    yield from self.stopped(condition, changed)
                    if condition is None or is_true(condition, changed):
                        self.succeeded |= {part.span.start} if after == "done" else set()
                        is_over = after in ("done", "stopped")
                        yield after if is_over else ("while", part, after), changed
            case ("fail",):
                yield "stopped", state
            case ("try", step, name, tries_left):
                self.started.add(name)
                precondition = self.skills[step.skill].precondition
                if precondition is not None and not is_true(precondition.term, state):
                    self.unready.add(name)
                yield ("run", step, name, tries_left), state
            case ("run", step, name, tries_left):
                for outcome in self.skills[step.skill].outcomes.values():
                    if outcome.probability != 0:
                        for measured in UNIT:
                            for after in self.ended(step, name, tries_left, outcome):
                                yield after, {**state, "v": measured, **outcome.effects}
            case ("handle", handling, again, lost):
                for after, changed in self.next(handling, state):
                    ends = {"done": again, "stopped": lost}
                    yield (
                        ends[after] if after in ("done", "stopped") else ("handle", after, again, lost),
                        changed,
                    )

    def stopped(
        self, condition: t.Term | None, state: dict[str, Any]
    ) -> Iterator[tuple[Process, dict[str, Any]]]:
        """Yield the states that may be measured after a stop: what the condition reads has any value."""
        read = sorted(t.variables_of(condition)) if condition is not None else []
        for values in itertools.product(*(UNIT if name == "v" else (False, True) for name in read)):
            for measured in UNIT:
                yield "stopped", {**state, "v": measured, **dict(zip(read, values, strict=True))}

    def ended(self, step: Step, name: str, tries_left: int, outcome: Outcome) -> Iterator[Process]:
        if not outcome.failure:
            yield "done"
            return
        lost: Process = "stopped"
        if step.last_handler is not None:
            lost = ("handle", self.handling(step.last_handler), "stopped", "stopped")
        again: Process = ("try", step, name, tries_left - 1)
        if tries_left and step.between_tries is not None:
            again = ("handle", self.handling(step.between_tries), again, lost)
        if tries_left:
            yield again
        yield lost  # the agent may leave out the tries that are left

    def handling(self, name: str) -> Process:
        return ("try", self.handlers[name], f"handler/{name}", self.handlers[name].retry)


def _uses(composition: Composition, skills: dict[str, Skill], branch: Part) -> tuple[set[str], set[str]]:
    """List what a branch writes and reads, by walking over everything that it may run."""
    written: set[str] = set()
    read: set[str] = set()
    pending = list(walk_parts(branch))
    seen = set()
    while pending:
        part = pending.pop()
        if isinstance(part, If):
            read |= t.variables_of(part.condition).keys()
        if isinstance(part, HeldPart):
            read |= t.variables_of(part.condition.term).keys()
        if isinstance(part, Step) and part.id not in seen:
            seen.add(part.id)
            skill = skills[part.skill]
            read |= t.variables_of(skill.precondition.term).keys() if skill.precondition else set()
            written |= {
                name for one in skill.outcomes.values() if one.probability != 0 for name in one.effects
            }
            pending += [composition.handlers[name] for name in part.handlers]
    return written, read


def _interferes(composition: Composition, skills: dict[str, Skill]) -> bool:
    for par in (part for part in walk_parts(composition.body) if isinstance(part, Par)):
        for one, other in itertools.permutations(par.branches, 2):
            written, (theirs, read) = _uses(composition, skills, one)[0], _uses(composition, skills, other)
            if written & (theirs | read):
                return True
    return False


def _refuted(module: Ecm, site: Site) -> tuple[set[str], set[str]]:
    """The ids of all claims and of those that are refuted."""
    claims = [*composition_obligations(module, site), *interface_obligations(module, site)]
    found = {str(one.id): one.verdict for one in claims if not isinstance(one, Obligation)}
    findings = discharge_obligations([one for one in claims if isinstance(one, Obligation)])
    found |= {str(one.obligation.id): one.verdict for one in findings}
    assert Verdict.UNKNOWN not in found.values()
    return set(found), {id_ for id_, verdict in found.items() if verdict is not Verdict.PROVED}


RUNS, STOPS, SIZES, RESOURCES, PAIRS, INTERFACES = Mix(), Mix(), Mix(), Mix(), Mix(), Mix()


def _compare(composition: Composition, skills: dict[str, Skill], mix: Mix) -> None:
    claims, refuted = _refuted(_module(skills, composition), _site())
    effects = {id_ for id_ in refuted if id_.endswith("/effects")}
    mix.compare("AE860", proved=not effects, expected=not _interferes(composition, skills))
    if effects or any("/resources/" in id_ for id_ in refuted):
        assert not any(id_.endswith("/reachable") for id_ in claims)
        return
    startable = any(is_true(composition.precondition, state) for state in STATES)
    mix.compare("AE855", proved="composition/c/can-start" not in refuted, expected=startable)
    machine = _Machine(composition, skills)
    numbers = {
        number: part.span.start
        for number, part in enumerate((one for one in walk_parts(composition.body) if isinstance(one, If)), 1)
    }
    uncovered = {int(id_.split("/")[2][3:]) for id_ in refuted if "/covers" in id_}
    assert {numbers[number] for number in uncovered} == machine.uncovered
    mix.compare("AE857", proved=not uncovered, expected=not machine.uncovered)
    unready = {id_.removeprefix("composition/c/").split("/ready")[0] for id_ in refuted if "/ready" in id_}
    assert unready == machine.unready
    mix.compare("AE851", proved=not unready, expected=not machine.unready)
    if startable:
        names = {step.id for step in steps_of(composition.body)}
        names |= {f"handler/{name}" for name in composition.handlers}
        never = {id_.split("/", 2)[2].removesuffix("/reachable") for id_ in refuted if "/reachable" in id_}
        assert never == names - machine.started
        mix.compare("AE855", proved=not never, expected=names <= machine.started)
        parts = [one for one in walk_parts(composition.body) if isinstance(one, StoppablePart)]
        failing = {int(id_.split("/")[2][5:]) for id_ in refuted if id_.endswith("/can-succeed")}
        spans = {one.span.start for one in parts}
        assert {parts[number - 1].span.start for number in failing} == spans - machine.succeeded
        if parts:
            mix.compare("AE863", proved=not failing, expected=spans <= machine.succeeded)


def test_a_composition_is_refused_exactly_where_some_run_goes_wrong() -> None:
    _composition_is_judged()
    RUNS.assert_both("AE851", "AE855", "AE857", "AE860")


@bounded
@given(_compositions(), _skills())
def _composition_is_judged(composition: Composition, skills: dict[str, Skill]) -> None:
    _compare(composition, skills, RUNS)


def test_parts_that_may_be_stopped_are_judged_by_all_their_runs() -> None:
    _stoppable_parts_are_judged()
    assert min(STOPS.count("AE851"), STOPS.count("AE855"), STOPS.count("AE863")) > 2


@bounded
@given(_compositions(has_stops=True), _skills())
def _stoppable_parts_are_judged(composition: Composition, skills: dict[str, Skill]) -> None:
    _compare(composition, skills, STOPS)


@examples(60, report_multiple_bugs=False)
@given(st.integers(96, 104), st.integers(15, 24), st.integers(0, 2), st.integers(0, 4), st.booleans())
def _sizes_are_judged(steps: int, depth: int, tries: int, handlers: int, is_deep: bool) -> None:
    spans = (TEXT.span(number, number + 1) for number in range(1000))
    names = [f"h{number}" for number in range(handlers)]
    chain = {
        name: Step(name, "s0", {}, {}, 0, None, following, next(spans))
        for name, following in zip(names, [*names[1:], None][: len(names)], strict=True)
    }
    first = names[0] if names else "stop"
    last = [Step(f"s{n}", "s0", {}, {}, 0, None, first, next(spans)) for n in range(1 if is_deep else steps)]
    body: Part = Seq(tuple(last))
    for _ in range(depth - 1 if is_deep else 0):
        body = TimedPart(body, next(spans), True, Fraction(1))
    for _ in range(0 if is_deep else tries):
        body = RetriedPart(body, 2, next(spans))
    composition = Composition("c", t.TRUE, None, body, chain, next(spans))
    skill = _skill("s0", None, [Outcome("done", {}, False, None, None)])
    module = _module({"s0": skill}, composition)
    found = {str(one.id): one for one in composition_obligations(module, _site())}
    claim = found["composition/c/fits-plan"]
    assert isinstance(claim, StaticClaim)
    refused = verify_plan(composition_to_graph(composition, "module"), {"module": module}, _site())
    SIZES.compare("AE864", proved=claim.diagnostic is None, expected=refused == [])


def test_a_composition_is_too_large_exactly_where_the_agent_refuses_it() -> None:
    _sizes_are_judged()
    SIZES.assert_both("AE864")


def test_an_interface_is_refused_exactly_where_some_start_or_some_success_breaks_it() -> None:
    _interface_is_judged()
    INTERFACES.assert_both("AE307")


@bounded
@given(_compositions(), _skills(), *[st.one_of(st.none(), st.sampled_from(CONDITIONS))] * 2)
def _interface_is_judged(
    composition: Composition, skills: dict[str, Skill], precondition: t.Term | None, achieves: t.Term | None
) -> None:
    start, end = (
        None if one is None else ActionCondition(one, "", TEXT.span(0, 1)) for one in (precondition, achieves)
    )
    interface = CapabilityInterface({}, {}, start, end, TEXT.span(0, 1))
    module = _module(skills, composition)
    module = replace(module, capabilities={"ability": ("c",)}, interfaces={"ability": interface})
    _, refuted = _refuted(module, _site())
    if any(id_.endswith("/effects") for id_ in refuted):
        return
    starts = [state for state in STATES if precondition is None or is_true(precondition, state)]
    startable = all(is_true(composition.precondition, state) for state in starts)
    INTERFACES.compare("AE307", proved="interface/ability/c/ready" not in refuted, expected=startable)
    both = t.And((composition.precondition, t.TRUE if precondition is None else precondition))
    machine = _Machine(replace(composition, precondition=both), skills)
    kept = achieves is None or all(is_true(achieves, state) for state in machine.final_states)
    broken = any(id_.startswith("interface/ability/c/achieved") for id_ in refuted)
    INTERFACES.compare("AE307", proved=not broken, expected=kept)


@bounded
@given(_compositions(), _skills())
def test_a_part_that_stands_for_a_composition_does_what_the_composition_does(
    composition: Composition, skills: dict[str, Skill]
) -> None:
    alone = _Machine(composition, skills)
    place = TEXT.span(999, 1000)
    body, handlers = nested("part", composition, place)
    inside = _Machine(Composition("outer", t.TRUE, None, body, handlers, TEXT.span(0, 1)), skills)

    def ends(machine: _Machine) -> set[tuple[tuple[str, Any], ...]]:
        return {tuple(state.items()) for state in machine.final_states}

    def names(found: set[str]) -> set[str]:
        return {
            f"handler/part.{name[8:]}" if name.startswith("handler/") else f"part.{name}" for name in found
        }

    assert ends(inside) == ends(alone)
    assert inside.started == names(alone.started)
    assert inside.unready == names(alone.unready)
    refused = any(not is_true(composition.precondition, state) for state in STATES)
    own = set() if composition.precondition_span is None else {place.start}
    assert inside.uncovered == alone.uncovered | (own if refused else set())


def test_a_resource_is_short_exactly_where_some_choice_of_steps_needs_more() -> None:
    _resources_are_judged()
    RESOURCES.assert_both("AE858")


@examples(250, report_multiple_bugs=False)
@given(_compositions(), _skills())
def _resources_are_judged(composition: Composition, skills: dict[str, Skill]) -> None:
    def choices(part: Part) -> Iterator[tuple[str, ...]]:
        """The skills that may run at one time."""
        match part:
            case Step():
                yield (part.skill,)
                for name in part.handlers:
                    yield from choices(composition.handlers[name])
            case Par(branches=branches):
                for chosen in itertools.product(*(list(choices(branch)) for branch in branches)):
                    yield tuple(itertools.chain(*chosen))
            case Seq(parts=parts):
                yield ()
                for inner in parts:
                    yield from choices(inner)
            case If(then=then, otherwise=otherwise):
                yield from choices(then)
                yield from () if otherwise is None else choices(otherwise)
            case Fallback() | RetriedPart() | StoppablePart() | FailingPart():
                yield ()
                body: Part = part
                for inner in children_of(body):
                    yield from choices(inner)

    site = _site()
    _, refuted = _refuted(_module(skills, composition), site)
    short = any(
        sum(name in skills[skill].resources for skill in together) > capacity
        for together in choices(composition.body)
        for name, capacity in site.resources.items()
    )
    enough = not any("/resources/" in id_ for id_ in refuted)
    RESOURCES.compare("AE858", proved=enough, expected=not short)


def test_questions_about_one_start_are_counted_from_one() -> None:
    either = [Outcome(name, {"p": name == "yes"}, False, None, None) for name in ("yes", "no")]
    skills = {"s0": _skill("s0", None, either), "s1": _skill("s1", t.Compare("==", P, V), either)}
    steps = tuple(
        Step(f"step{at}", f"s{at}", {}, {}, 0, None, None, TEXT.span(at, at + 1)) for at in range(2)
    )
    composition = Composition("c", t.TRUE, None, Seq(steps), {}, TEXT.span(3, 4))
    claims, refuted = _refuted(_module(skills, composition), _site())
    ready = {f"composition/c/step1/ready/{number}" for number in (1, 2)}
    assert ready == {id_ for id_ in claims if "/ready" in id_} == refuted


# Two actions at once: each of one parameter with a few values.

GRID = [Fraction(value, 2) for value in range(-2, 3)]
X = Declared(
    t.Variable("x", REAL, t.VariableRole.PARAMETER), TEXT.span(0, 1), range=(Fraction(-1), Fraction(1))
)
_AX, _BX = (t.Variable(f"{role}.x", REAL, t.VariableRole.PARAMETER) for role in "ab")
_LIMITS = st.sampled_from([t.Literal(value, REAL) for value in GRID])
_BOUNDS = st.builds(lambda limit: t.Compare("<=", X.variable, limit), _LIMITS)
_ENVELOPES = st.one_of(
    _BOUNDS,
    st.builds(lambda name, bound: t.Implies(STATE[name].variable, bound), st.sampled_from("pq"), _BOUNDS),
    st.builds(lambda name, bound: t.And((STATE[name].variable, bound)), st.sampled_from("pq"), _BOUNDS),
)
_JOINT = st.one_of(
    st.just(t.Compare("<", _AX, t.Literal(GRID[0], REAL))),
    st.builds(lambda limit: t.Compare("<=", t.Extremum("max", _AX, _BX), limit), _LIMITS),
    st.builds(lambda limit: t.Compare("<=", t.Extremum("min", _AX, _BX), limit), _LIMITS),
    st.builds(lambda limit: t.Implies(P, t.Compare("<=", _AX, limit)), _LIMITS),
    st.just(t.Compare("<=", _AX, _BX)),
)


def _pair(
    envelopes: tuple[t.Term, t.Term], phi: t.Term, rule: t.Term, kinds: tuple[str, str]
) -> tuple[Ecm, Site]:
    span = TEXT.span(0, 1)
    actions = {name: ActionKind(name, frozenset(), Risk.LOW, False, {"x": X}, span) for name in "mn"}
    roles = (("a", "m"), ("b", "n"))
    site = _site(
        kinds=actions,
        rules=(Rule("phi", "", "", "", {"m": phi, "n": phi}, {}, span, span),),
        joint_rules=(JointRule("both", "", "", "", roles, rule, span, span),),
    )
    skills = {
        name: _skill(
            name,
            None,
            [Outcome("o", {}, False, None, None)],
            envelope={kind: ActionCondition(term, "", span)},
        )
        for name, kind, term in zip(("s0", "s1"), kinds, envelopes, strict=True)
    }
    steps = [Step(name, name, {}, {}, 0, None, None, TEXT.span(at, at + 1)) for at, name in enumerate(skills)]
    composition = Composition("c", t.TRUE, None, Par(tuple(steps), span), {}, span)
    return _module(skills, composition), site


def _allowed(phi: t.Term) -> Iterator[dict[str, Any]]:
    """Every two actions that are allowed in one state, and that state."""
    for now, a, b in itertools.product(STATES, GRID, GRID):
        if is_true(phi, {**now, "x": a}) and is_true(phi, {**now, "x": b}):
            yield {**now, "a.x": a, "b.x": b}


def _broken(envelopes: tuple[t.Term, t.Term], phi: t.Term, rule: t.Term, kinds: tuple[str, str]) -> bool:
    """Return true if two actions, each asked for in some state and allowed now, break the joint rule."""
    for first, second in ((0, 1), (1, 0)):
        if (kinds[first], kinds[second]) != ("m", "n"):
            continue
        for a, b in itertools.product(GRID, GRID):
            if not any(is_true(envelopes[first], {**then, "x": a}) for then in STATES):
                continue
            if not any(is_true(envelopes[second], {**then, "x": b}) for then in STATES):
                continue
            for now in STATES:
                allowed = is_true(phi, {**now, "x": a}) and is_true(phi, {**now, "x": b})
                if allowed and not is_true(rule, {**now, "a.x": a, "b.x": b}):
                    return True
    return False


def test_two_actions_are_refused_exactly_where_some_pair_breaks_the_joint_rule() -> None:
    _pairs_are_judged()
    PAIRS.assert_both("AE601", "AE603", "AE861")


@bounded
@given(
    st.tuples(_ENVELOPES, _ENVELOPES),
    _ENVELOPES,
    _JOINT,
    st.permutations(["m", "n"]).map(lambda ks: (ks[0], ks[1])),
)
def _pairs_are_judged(
    envelopes: tuple[t.Term, t.Term], phi: t.Term, rule: t.Term, kinds: tuple[str, str]
) -> None:
    # Order alone decides all of it, and bounds are on the grid, so a bound itself is always tried.
    module, site = _pair(envelopes, phi, rule, kinds)
    _, refuted = _refuted(module, site)
    together = not any("/joint/" in id_ for id_ in refuted)
    PAIRS.compare("AE861", proved=together, expected=not _broken(envelopes, phi, rule, kinds))
    found = {one.obligation.code: one for one in discharge_obligations(joint_policy_obligations(site))}
    allowed = list(_allowed(phi))
    kept = [is_true(rule, values) for values in allowed]
    PAIRS.compare("AE601", proved=found["AE601"].verdict is Verdict.PROVED, expected=any(kept))
    assert found["AE603"].verdict in (Verdict.PROVED, Verdict.VACUOUS)
    PAIRS.compare("AE603", proved=found["AE603"].verdict is Verdict.PROVED, expected=not all(kept))


# Broken twins: the comparison above notices a verifier that is wrong in one place.


@pytest.mark.deep
def test_failures_that_are_ignored_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    original = symbolic_paths.PathExploration._run

    def only_successes(self: Any, step: Step, before: Any, done: Any) -> Any:
        original(self, step, before, done)
        return {}

    monkeypatch.setattr(symbolic_paths.PathExploration, "_run", only_successes)
    with pytest.raises(AssertionError):
        _composition_is_judged()


def test_a_handler_after_the_last_try_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    def always_handled(self: Any, step: Step, before: Any, name: str, failed: Any) -> Any:
        done: Any = {}
        for _ in range(step.retry + 1):
            self._record_visit(name, before)
            before = self._run(step, before, done)
            if before and step.between_tries is not None:
                handler = self.handlers[step.between_tries]
                before = self._step(handler, before, f"handler/{step.between_tries}", failed)
        return done

    fails = [Outcome("o", {"p": True}, True, None, None), Outcome("s", {}, False, None, None)]
    helps = [Outcome("o", {"q": True}, False, None, None)]
    skills = {"s0": _skill("s0", None, fails), "s1": _skill("s1", t.Not(t.And((P, Q))), helps)}
    handler = Step("h", "s1", {}, {}, 0, None, None, TEXT.span(1, 2))
    body = Step("step", "s0", {}, {}, 1, "h", None, TEXT.span(2, 3))
    composition = Composition("c", t.Not(Q), TEXT.span(3, 4), body, {"h": handler}, TEXT.span(4, 5))
    _compare(composition, skills, RUNS)
    monkeypatch.setattr(symbolic_paths.PathExploration, "_step", always_handled)
    with pytest.raises(AssertionError):
        _compare(composition, skills, RUNS)


def test_branches_that_wait_for_each_other_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    def in_sequence(self: Any, part: Par[Step], before: Any, failed: Any) -> Any:
        for branch in part.branches:
            before = self.execute(branch, before, failed)
        return before

    fails = Outcome("o", {}, True, None, None)
    well = Outcome("o", {}, False, None, None)
    skills = {
        "s0": _skill("s0", None, [fails]),
        "s1": _skill("s1", None, [well]),
        "s2": _skill("s2", P, [well]),
    }
    first, second, third = (
        Step(f"step{at}", f"s{at}", {}, {}, 0, None, None, TEXT.span(at, at + 1)) for at in range(3)
    )
    guarded = If(P, "", second, first, TEXT.span(3, 4))
    body = Par((guarded, third), TEXT.span(4, 5))  # the third starts also where the first fails
    composition = Composition("c", t.TRUE, None, body, {}, TEXT.span(5, 6))
    _compare(composition, skills, RUNS)
    monkeypatch.setattr(symbolic_paths.PathExploration, "_par", in_sequence)
    with pytest.raises(AssertionError):
        _compare(composition, skills, RUNS)


@pytest.mark.deep
def test_one_order_of_the_roles_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    original = joint.joint_obligations
    monkeypatch.setattr(
        "aeros.spec.obligations.parallel.joint_obligations",
        lambda composition, par, site, one, other: (
            claim
            for claim in original(composition, par, site, one, other)
            if claim.id.names[2:4] == (one.name, other.name)
        ),
    )
    with pytest.raises(AssertionError):
        _pairs_are_judged()


@pytest.mark.deep
def test_a_guard_that_is_forgotten_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(symbolic_paths, "split_conjunction", lambda term: frozenset())
    with pytest.raises(AssertionError):
        _composition_is_judged()
