"""Claims about compositions: on every path of declared outcomes each step may start.

- ready: wherever a step or handler starts, its skill's precondition holds.  A guard is known of the
  first step's precondition alone; what the gate decides of a skill's actions never assumes it
  (docs/decisions/0003-precondition-is-not-assumed.md).
- covers: an `if` without `else` is met only where its condition holds.
- reachable: every step and handler runs on some path.
- handled: of every step that may fail something is said; handlers do not lead back to each other.
- data: an output that flows to an input is there on every path, of its type and unit, inside its range.

Retries are bounded by elaboration.  What parallel branches owe each other is in `parallel`.  A module
without compositions has no obligation of this group.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final

from aeros.spec.diagnostics.codes import Diagnostic, Label
from aeros.spec.expr import terms as t
from aeros.spec.flow.arguments import arguments_of
from aeros.spec.flow.control_flow import handler_cycle
from aeros.spec.flow.symbolic_paths import (
    Situations,
    TooManyPathsError,
    conjuncts,
    earlier_in,
    folded,
    paths_of,
)
from aeros.spec.model.composition import Composition, Step
from aeros.spec.model.hold_conditions import UNHELD
from aeros.spec.model.model import Declared, Ecm, Site, Skill
from aeros.spec.model.step_graph import If, parts_of, steps_of
from aeros.spec.obligations.claim_id import ClaimForm, ClaimId
from aeros.spec.obligations.data_flow import data_obligations
from aeros.spec.obligations.obligation import Claim, Member, Obligation, Space
from aeros.spec.obligations.parallel import parallel_obligations
from aeros.spec.obligations.verdicts import Settled, Verdict


def composition_obligations(ecm: Ecm, site: Site) -> Iterator[Obligation | Settled]:
    """Every claim of group composition about `ecm` under `site`."""
    for composition in ecm.compositions.values():
        yield from _failures_handled(composition, ecm.skills)
        yield from data_obligations(composition, ecm.skills)
        cycle = handler_cycle(composition)
        acyclic = ClaimForm.HANDLERS_ACYCLIC(composition.id)
        yield Settled(acyclic, _cycle(composition, cycle) if cycle else None)
        if cycle:
            continue
        parallel = list(parallel_obligations(composition, ecm, site))
        yield from parallel
        if any(isinstance(one, Settled) and one.verdict is Verdict.REFUTED for one in parallel):
            continue  # branches that interfere are not walked: their order would decide
        try:
            yield from _path_obligations(composition, ecm, site)
        except TooManyPathsError:
            yield Settled(
                ClaimForm.PATHS_EXPLORED(composition.id),
                Diagnostic(
                    "AE862",
                    f"`{composition.id}` has too many paths to prove anything of them",
                    Label(composition.span),
                    help=("split it, or let fewer steps be tried again",),
                ),
            )


def _failures_handled(composition: Composition, skills: Mapping[str, Skill]) -> Iterator[Settled]:
    for step in steps_of(composition.body):
        skill = skills[step.skill]
        failures = [one.id for one in skill.outcomes.values() if one.failure and one.probability != 0]
        failures += [] if skill.hold is None else [UNHELD]
        said = not failures or step.retry > 0 or step.on_failure is not None
        yield Settled(
            ClaimForm.STEP_FAILURE_HANDLED(composition.id, step.id),
            None
            if said
            else Diagnostic(
                "AE854",
                f"`{step.id}` may fail, and nothing is said of what follows",
                Label(step.span, "may end as " + ", ".join(f"`{name}`" for name in failures)),
                help=("write `on_failure: stop`, or `retry` with an `on_failure` that helps",),
            ),
        )


def _cycle(composition: Composition, cycle: list[str]) -> Diagnostic:
    first, *others = dict.fromkeys(cycle)
    return Diagnostic(
        "AE856",
        "handlers lead back to each other: " + " → ".join(f"`{name}`" for name in cycle),
        Label(composition.handlers[first].span, "a failure here leads on"),
        tuple(Label(composition.handlers[name].span, "and here") for name in others),
        help=("let one of them end: without `on_failure`, its failure stops the composition",),
    )


def _path_obligations(composition: Composition, ecm: Ecm, site: Site) -> Iterator[Obligation | Settled]:
    states = tuple(site.state.values())
    if composition.precondition_span is not None:
        yield Obligation(
            ClaimForm.COMPOSITION_CAN_START(composition.id),
            "AE855",
            Claim.SOMETIMES,
            Space(states, ()),
            composition.precondition,
            f"`{composition.id}` could never start: no state satisfies its precondition",
            Label(composition.precondition_span, "never true"),
        )
    paths = paths_of(composition, ecm.skills, site.state)
    steps = {step.id: step for step in steps_of(composition.body)}
    listed = [(id_, _STEP, id_, step) for id_, step in steps.items()]
    listed += [(f"handler/{id_}", _HANDLER, id_, step) for id_, step in composition.handlers.items()]
    for visited, (reachable, ready, ready_case), id_, step in listed:
        visits = paths.visits.get(visited, {})
        yield _reachable(reachable(composition.id, id_), composition, step, visits, states)
        skill = ecm.skills[step.skill]
        if skill.precondition is None:
            continue
        arguments = arguments_of(step, steps, ecm.skills)
        yield from _in_each(
            (ready, ready_case),
            (composition.id, id_),
            t.substitute(skill.precondition.term, arguments.terms),
            visits,
            site.state,
            _obligation(
                "AE851",
                f"`{step.id}` may start where its precondition does not hold",
                Label(step.span, "started here"),
                Label(skill.precondition.span, "may not hold then"),
                "let a step before it bring the precondition about, or declare it of the composition",
                (*states, *arguments.declared),
            ),
            [
                Member(t.substitute(part.term, arguments.terms), Label(part.span, "may not hold then"))
                for part in skill.precondition.conjuncts
            ],
        )
    conditions = [part for part in parts_of(composition.body) if isinstance(part, If)]
    for number, part in enumerate(conditions, 1):
        if part.otherwise is None:
            yield from _in_each(
                (ClaimForm.IF_COVERS, ClaimForm.IF_COVERS_CASE),
                (composition.id, number),
                part.condition,
                paths.cases.get(part.span.start, {}),
                site.state,
                _obligation(
                    "AE857",
                    f"nothing is said of what follows where not `{part.text}`",
                    Label(part.span, "may not hold here"),
                    None,
                    "write `else: nothing`, or what to do then",
                    states,
                ),
            )


_STEP: Final = ClaimForm.STEP_REACHABLE, ClaimForm.STEP_READY, ClaimForm.STEP_READY_CASE
_HANDLER: Final = ClaimForm.HANDLER_REACHABLE, ClaimForm.HANDLER_READY, ClaimForm.HANDLER_READY_CASE

_Builder = Callable[[ClaimId, tuple[t.Term, ...], t.Term, str, tuple[Declared, ...]], Obligation]
"""From an id, what is assumed, what is claimed, a note and further variables to an obligation."""


def _obligation(
    code: str,
    headline: str,
    primary: Label,
    beside: Label | None,
    help_: str,
    declared: tuple[Declared, ...],
) -> _Builder:
    def build(
        claim_id: ClaimId,
        assumed: tuple[t.Term, ...],
        conclusion: t.Term,
        note: str,
        further: tuple[Declared, ...],
    ) -> Obligation:
        return Obligation(
            claim_id,
            code,
            Claim.ALWAYS,
            Space((*declared, *further), assumed),
            conclusion,
            headline,
            primary,
            () if beside is None else (beside,),
            (help_,),
            notes=(note,) if note else (),
        )

    return build


def _in_each(
    forms: tuple[ClaimForm, ClaimForm],
    about: tuple[str | int, ...],
    term: t.Term,
    situations: Situations,
    state: Mapping[str, Declared],
    build: _Builder,
    parts: Sequence[Member] = (),
) -> Iterator[Obligation | Settled]:
    """`term` holds in every situation: at once where no variable matters, else as a question each.

    Where it fails for certain, that one is all there is to tell.
    forms: of the claim where it is one, and of each where they are several, which are numbered from 1.
    about: the names of the composition and of what in it the claim is about.
    parts: the conjuncts of `term`.
    """
    asked: dict[tuple[tuple[t.Term, ...], t.Term], tuple[str, tuple[Member, ...]]] = {}
    for situation, trace in situations.items():
        condition = situation.condition(term, state)
        assumed = tuple(sorted(situation.assumed, key=repr))
        if condition == t.TRUE:
            continue
        values = dict(situation.assigned)
        then = [
            f"then {name} = {str(values[name]).lower()}" for name in t.variables_of(term) if name in values
        ]
        note = "\n".join(["after", *trace, *then]) if trace else ""
        members = tuple(Member(situation.condition(part.term, state), part.label) for part in parts)
        if condition == t.FALSE and not assumed:
            yield replace(build(forms[0](*about), (), condition, note, ()), members=members)
            return
        asked.setdefault((assumed, condition), (note, members))
    if not asked:
        yield Settled(forms[0](*about), None)
    for number, ((assumed, condition), (note, members)) in enumerate(asked.items(), 1):
        claim_id = forms[1](*about, number) if len(asked) > 1 else forms[0](*about)
        yield replace(build(claim_id, assumed, condition, note, earlier_in(assumed, state)), members=members)


def _reachable(
    claim_id: ClaimId,
    composition: Composition,
    step: Step,
    visits: Situations,
    declared: tuple[Declared, ...],
) -> Obligation | Settled:
    """Some path leads to `step`: at once if one assumes no more than the composition's precondition."""
    headline = f"`{step.id}` can never run in `{composition.id}`"
    label = Label(step.span, "no path of outcomes leads here")
    help_ = ("remove it, or correct the condition or the outcome before it",)
    if not visits:
        return Settled(claim_id, Diagnostic("AE855", headline, label, help=help_))
    known = conjuncts(folded(composition.precondition))
    if any(situation.assumed <= known for situation in visits):
        return Settled(claim_id, None)
    ways = tuple(t.And(tuple(sorted(situation.assumed, key=repr))) for situation in visits)
    mentioned = {name for way in ways for name in t.variables_of(way)}
    past = earlier_in(ways, {one.name: one for one in declared})
    space = Space(tuple(one for one in (*declared, *past) if one.name in mentioned), ())
    return Obligation(claim_id, "AE855", Claim.SOMETIMES, space, t.Or(ways), headline, label, help=help_)
