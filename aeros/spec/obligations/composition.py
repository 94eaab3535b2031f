"""Claims about compositions: on every path of declared outcomes, each step may start.

- ready: wherever a step or handler starts, its skill's precondition holds.  The condition of an `if` is known
  for the first step's precondition alone; the gate's decisions on a skill's actions never assume it
  (docs/decisions/0003-precondition-is-not-assumed.md).
- covers: an `if` without `else` is reached only where its condition holds.
- reachable: every step and handler runs on some path, but for those of another composition that a step stands
  for, of which it is claimed by itself.
- handled: every step that may fail, and every part under `hold` or within `timeout`, says how its failure is
  handled; handlers do not form a cycle.
- can succeed: some run of a part under `hold` or within `timeout` ends with the condition held, and in time.
- fits a plan: the composition has no more steps, tries and levels than the agent runs.
- data: an output that flows to an input is available on every path, of its type and unit, inside its range.

Retries are bounded by elaboration.  Claims about parallel branches are in `parallel`.  A module without
compositions has no obligation of this group.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

from aeros.spec.consequences.consequences import known_definitions, with_consequences
from aeros.spec.consequences.durations import shortest_success
from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel
from aeros.spec.expr import terms as t
from aeros.spec.expr.units import format_number
from aeros.spec.flow.arguments import step_arguments
from aeros.spec.flow.symbolic_paths import (
    SymbolicStates,
    TooManyPathsError,
    earlier_measurements,
    explore_paths,
    fold_constants,
    split_conjunction,
)
from aeros.spec.model.composition import Composition, Part, Step, count_runs, handler_cycle
from aeros.spec.model.ecm import Ecm, Skill
from aeros.spec.model.hold_conditions import HOLD_LOST
from aeros.spec.model.site import Site
from aeros.spec.model.step_graph import (
    Fallback,
    HeldPart,
    If,
    NestedIf,
    RetriedPart,
    StoppablePart,
    TimedPart,
    plan_size_fault,
    steps_of,
    walk_parts,
)
from aeros.spec.model.variables import Declared
from aeros.spec.obligations.claim_id import ClaimForm, ClaimId
from aeros.spec.obligations.data_flow import data_obligations
from aeros.spec.obligations.obligation import ClaimMode, LabelledConjunct, Obligation, VariableSpace
from aeros.spec.obligations.outcomes.per_situation import obligation_per_situation, skills_of_steps
from aeros.spec.obligations.parallel import parallel_obligations
from aeros.spec.obligations.verdicts import StaticClaim, Verdict


def composition_obligations(ecm: Ecm, site: Site) -> Iterator[Obligation | StaticClaim]:
    """Make every claim of group composition about a module.

    Args:
        ecm: the module.
        site: site under which it is elaborated.

    Yields:
        Claims settled at once, and obligations for the solver.
    """
    ecm = with_consequences(ecm, site)
    for composition in ecm.compositions.values():
        yield from _failures_handled(composition, ecm.callable_skills)
        yield from data_obligations(composition, ecm.callable_skills)
        cycle = handler_cycle(composition)
        acyclic = ClaimForm.HANDLERS_ACYCLIC(composition.id)
        yield StaticClaim(acyclic, _cycle(composition, cycle) if cycle else None)
        if cycle:
            continue
        yield _fits_plan(composition)
        parallel = list(parallel_obligations(composition, ecm, site))
        yield from parallel
        if any(isinstance(one, StaticClaim) and one.verdict is Verdict.REFUTED for one in parallel):
            continue  # branches that interfere are not explored: the result would depend on their order
        try:
            yield from _path_obligations(composition, ecm, site)
        except TooManyPathsError:
            yield StaticClaim(
                ClaimForm.PATHS_EXPLORED(composition.id),
                Diagnostic(
                    "AE862",
                    f"`{composition.id}` has too many paths to explore, so nothing is proved of it",
                    SpanLabel(composition.span),
                    help=("split it, or use fewer retries",),
                ),
            )


def _fits_plan(composition: Composition) -> StaticClaim:
    """Claim that the agent accepts the composition as a plan."""
    reason = plan_size_fault(composition.body, count_runs(composition))
    claim_id = ClaimForm.COMPOSITION_FITS_PLAN(composition.id)
    if reason is None:
        return StaticClaim(claim_id, None)
    headline = f"the agent does not run `{composition.id}`: {reason}"
    help_ = ("split it into compositions that rules of a task run one after the other",)
    return StaticClaim(claim_id, Diagnostic("AE864", headline, SpanLabel(composition.span), help=help_))


def _failures_handled(composition: Composition, skills: Mapping[str, Skill]) -> Iterator[StaticClaim]:
    goes_on = {id(part) for part in _parts_that_may_fail(composition.body)}
    for step in steps_of(composition.body):
        failures: list[str] = []
        for skill in (skills[name] for name in step.runs):
            failures += [one.id for one in skill.outcomes.values() if one.failure and one.probability != 0]
            failures += [] if skill.hold_condition is None else [HOLD_LOST]
        handled = not failures or step.retry > 0 or step.on_failure is not None or id(step) in goes_on
        yield StaticClaim(
            ClaimForm.STEP_FAILURE_HANDLED(composition.id, step.id),
            None
            if handled
            else Diagnostic(
                "AE854",
                f"`{step.id}` may fail, and the composition does not say how to continue",
                SpanLabel(step.span, "may end as " + ", ".join(f"`{name}`" for name in failures)),
                help=(
                    "add `on_failure: stop`, or `retry` with a handler under `between_tries`, or put it into "
                    "`any` or `tolerate`",
                ),
            ),
        )
    for number, part in enumerate(_stoppable_parts(composition), 1):
        form = "hold" if isinstance(part, HeldPart) else "timeout"
        why = "its condition may break at any time" if form == "hold" else "its time may pass"
        yield StaticClaim(
            ClaimForm.PART_FAILURE_HANDLED(composition.id, number),
            None
            if part.stops_composition or id(part) in goes_on
            else Diagnostic(
                "AE854",
                f"this `{form}` may fail, and the composition does not say how to continue",
                SpanLabel(part.span, why),
                help=("add `on_failure: stop`, or put it into `any` or `tolerate`",),
            ),
        )


def _stoppable_parts(composition: Composition) -> list[StoppablePart[Step]]:
    return [part for part in walk_parts(composition.body) if isinstance(part, StoppablePart)]


def _parts_that_may_fail(part: Part) -> Iterator[Part]:
    """Yield the parts and steps whose failure leads to another alternative, or to another try of a part."""
    for inner in walk_parts(part):
        if isinstance(inner, RetriedPart):
            yield from walk_parts(inner.part)
        elif isinstance(inner, Fallback):
            for alternative in inner.parts[:-1]:
                yield from walk_parts(alternative)


def _cycle(composition: Composition, cycle: list[str]) -> Diagnostic:
    first, *others = dict.fromkeys(cycle)
    return Diagnostic(
        "AE856",
        "handlers lead back to each other: " + " → ".join(f"`{name}`" for name in cycle),
        SpanLabel(composition.handlers[first].span, "a failure here leads to the next handler"),
        tuple(SpanLabel(composition.handlers[name].span, "and here") for name in others),
        help=("let the failure of one of them stop the composition: remove its handler",),
    )


def _path_obligations(composition: Composition, ecm: Ecm, site: Site) -> Iterator[Obligation | StaticClaim]:
    states = tuple(site.state.values())
    if composition.precondition_span is not None:
        yield Obligation(
            ClaimForm.COMPOSITION_CAN_START(composition.id),
            "AE855",
            ClaimMode.SOMETIMES,
            VariableSpace(states, ()),
            composition.precondition,
            f"`{composition.id}` could never start: no state satisfies its precondition",
            SpanLabel(composition.precondition_span, "never true"),
        )
    skills = ecm.callable_skills
    paths = explore_paths(composition, skills, site.state, known_definitions(ecm))
    steps = {step.id: step for step in steps_of(composition.body)}
    listed = [(id_, _STEP, id_, step) for id_, step in steps.items()]
    listed += [(f"handler/{id_}", _HANDLER, id_, step) for id_, step in composition.handlers.items()]
    ran = skills_of_steps(composition, skills)
    for visited, (reachable, ready, ready_case), id_, step in listed:
        visits = paths.states_at_steps.get(visited, {})
        if not step.is_nested:
            yield _reachable(reachable(composition.id, id_), composition, step, visits, states)
        for name in step.runs:
            clause = skills[name].precondition
            if clause is None:
                continue
            arguments = step_arguments(step, steps, skills, name)
            shown = f"`{step.id}`" if len(step.runs) == 1 else f"`{name}`, which `{step.id}` may run,"
            claim = Obligation(
                ready(composition.id, id_ if len(step.runs) == 1 else f"{id_}-{name}"),
                "AE851",
                ClaimMode.ALWAYS,
                VariableSpace((*states, *arguments.variables), ()),
                t.substitute(clause.term, arguments.terms),
                f"{shown} may start where its precondition does not hold",
                SpanLabel(step.span, "started here"),
                (SpanLabel(clause.span, "may not hold then"),),
                ("add a step before it that makes the precondition true, or declare it for the composition",),
                labelled_conjuncts=tuple(
                    LabelledConjunct(
                        t.substitute(part.term, arguments.terms), SpanLabel(part.span, "may not hold then")
                    )
                    for part in clause.conjuncts
                ),
            )
            yield from obligation_per_situation(claim, ready_case, visits, site.state, ran)
    for number, stoppable in enumerate(_stoppable_parts(composition), 1):
        yield _can_succeed(number, composition, stoppable, skills, paths.states_after_parts, states)
    conditions = [part for part in walk_parts(composition.body) if isinstance(part, If)]
    for number, part in enumerate(conditions, 1):
        if part.otherwise is None:
            claim = _always_true(ClaimForm.IF_COVERS(composition.id, number), part, states)
            situations = paths.states_at_ifs.get(id(part), {})
            case = ClaimForm.IF_COVERS_CASE
            yield from obligation_per_situation(claim, case, situations, site.state, ran)


def _always_true(claim_id: ClaimId, part: If[Step], states: tuple[Declared, ...]) -> Obligation:
    """Claim that a condition without an `else` holds wherever it is decided."""
    text, help_ = f"if `{part.text}` does not hold", "add `else` with a part, or `else: nothing`"
    code, headline = "AE857", f"the composition does not say how to continue {text}"
    if isinstance(part, NestedIf) and part.is_precondition:
        code = "AE851"
        headline = f"a composition may start where `{part.text}`, its precondition, does not hold"
        help_ = "add a step before it that makes the precondition true"
    return Obligation(
        claim_id,
        code,
        ClaimMode.ALWAYS,
        VariableSpace(states, ()),
        part.condition,
        headline,
        SpanLabel(part.span, "may not hold here"),
        help=(help_,),
    )


_STEP: Final = ClaimForm.STEP_REACHABLE, ClaimForm.STEP_READY, ClaimForm.STEP_READY_CASE
_HANDLER: Final = ClaimForm.HANDLER_REACHABLE, ClaimForm.HANDLER_READY, ClaimForm.HANDLER_READY_CASE


def _reachable(
    claim_id: ClaimId,
    composition: Composition,
    step: Step,
    visits: SymbolicStates,
    declared: tuple[Declared, ...],
) -> Obligation | StaticClaim:
    """Claim that some path leads to `step`."""
    found = Diagnostic(
        "AE855",
        f"`{step.id}` can never run in `{composition.id}`",
        SpanLabel(step.span, "no path of outcomes leads here"),
        help=("remove it, or correct the condition or the outcome before it",),
    )
    return _some_path(claim_id, composition, found, visits, declared)


def _can_succeed(
    number: int,
    composition: Composition,
    part: StoppablePart[Step],
    skills: Mapping[str, Skill],
    ends: Mapping[int, SymbolicStates],
    declared: tuple[Declared, ...],
) -> Obligation | StaticClaim:
    """Claim that some run of a part ends with its condition held, and in time."""
    claim_id = ClaimForm.PART_CAN_SUCCEED(composition.id, number)
    help_ = "weaken the condition so that it agrees with the effects of the steps"
    found = Diagnostic(
        "AE863", "no run of this part ends with its condition held", SpanLabel(part.span), help=(help_,)
    )
    if isinstance(part, TimedPart):
        needed = shortest_success(part.part, skills)
        times = "" if needed is None else f" within {format_number(part.timeout)} s"
        label = "" if not needed else f"takes at least {format_number(needed)} s"
        headline, help_ = f"no run of this part succeeds{times}", "give it more time, or correct its steps"
        found = Diagnostic("AE863", headline, SpanLabel(part.span, label), help=(help_,))
        if needed is None or needed > part.timeout:
            return StaticClaim(claim_id, found)
    return _some_path(claim_id, composition, found, ends.get(id(part), {}), declared)


def _some_path(
    claim_id: ClaimId,
    composition: Composition,
    otherwise: Diagnostic,
    visits: SymbolicStates,
    declared: tuple[Declared, ...],
) -> Obligation | StaticClaim:
    """Claim that some path leads to one of some situations; settled if one assumes only the precondition."""
    if not visits:
        return StaticClaim(claim_id, otherwise)
    known = split_conjunction(fold_constants(composition.precondition))
    if any(situation.known <= known for situation in visits):
        return StaticClaim(claim_id, None)
    ways = tuple(t.And(tuple(sorted(situation.known, key=repr))) for situation in visits)
    mentioned = {name for way in ways for name in t.variables_of(way)}
    past = earlier_measurements(ways, {one.name: one for one in declared})
    space = VariableSpace(tuple(one for one in (*declared, *past) if one.name in mentioned), ())
    return Obligation(
        claim_id,
        otherwise.code,
        ClaimMode.SOMETIMES,
        space,
        t.Or(ways),
        otherwise.headline,
        otherwise.primary or SpanLabel(composition.span),
        help=otherwise.help,
    )
