"""Claims about a task's planning rules, over every path of every declared outcome.

The claims are about the agent's loop, the transition system of `aeros.spec.closed_loop`:

- dispatch: whenever a step of a plan is due for its first try, its skill's precondition holds; where it names
  a capability, the precondition of every provider holds;
- progress: from every reachable state the goal can be reached, whichever providers are chosen;
- each invariant of the task: it holds in every reachable state, the last included.

States are listed one by one.  Where there are too many, they are computed as sets, and a certificate of
obligations makes the solver check the sets.  A refutation is a trace of steps and outcomes from a start.
Not modelled: the cap on re-plans (progress is possible, not certain; `aeros predict` says how likely);
variables that change by themselves.  A variable that a step leaves at several values is branched on.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from aeros.spec.backends.package_versions import package_version
from aeros.spec.closed_loop.composed_run import HandlerCycleError
from aeros.spec.closed_loop.findings import LoopFindings, LoopPath, format_path
from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.closed_loop.reachability import UnlistedStatesError, explore_system
from aeros.spec.closed_loop.transition_system import TransitionSystem
from aeros.spec.consequences.start_values import find_start_contradiction
from aeros.spec.consequences.words import unsettled_note
from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.expr import terms as t
from aeros.spec.model.ecm import Ecm, PlanningRule, Task, TaskInvariant
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.obligation import ClaimMode, Obligation, VariableSpace
from aeros.spec.obligations.verdicts import StaticClaim, Verdict

if TYPE_CHECKING:
    from aeros.spec.closed_loop.symbolic.certificate import CertificateClaim


def closed_loop_obligations(ecm: Ecm, site: Site) -> Iterator[Obligation | StaticClaim]:
    """Make every claim of group closed-loop about the tasks of a module.

    Args:
        ecm: the module.
        site: site under which it is elaborated.

    Yields:
        The claims, each settled by exploring the task's reachable states.
    """
    for task in ecm.tasks.values():
        try:
            yield from _task_claims(ecm, task, site)
        except StateSpaceError as error:
            if isinstance(error, HandlerCycleError) and error.composition.id in ecm.compositions:
                continue  # the composition is refused: AE856
            yield StaticClaim(ClaimForm.RULES_ANALYSED(task.id), _analysis_undecided(task, str(error)))


def _task_claims(ecm: Ecm, task: Task, site: Site) -> list[Obligation | StaticClaim]:
    system = TransitionSystem(ecm, task, site)
    try:
        return [*_settled_claims(ecm, site, explore_system(system))]
    except UnlistedStatesError:
        # Importing this and its library takes longer than most proofs.
        from aeros.spec.closed_loop.symbolic.analysis import SymbolicLoop
        from aeros.spec.closed_loop.symbolic.certificate import CertificateTooLargeError

        found = SymbolicLoop(system)
    engine = f"dd {package_version('dd', 'dd')}"
    settled = _settled_claims(ecm, site, found, engine)
    if any(one.verdict is Verdict.REFUTED for one in settled):
        return [*settled]
    try:
        return [*settled, *certificate_obligations(task, found.certificate())]
    except CertificateTooLargeError:
        return [
            replace(one, engine=f"{engine}, without a certificate, which is too large") for one in settled
        ]


def _settled_claims(ecm: Ecm, site: Site, found: LoopFindings, engine: str = "") -> list[StaticClaim]:
    task = found.system.task
    effective = _impossible_start(ecm, task, site) or _task_without_rules(found)
    settled = [
        StaticClaim(ClaimForm.RULES_DISPATCH(task.id), _rule_never_dispatched(ecm, found), engine),
        StaticClaim(ClaimForm.RULES_PROGRESS(task.id), _goal_unreachable(found), engine),
        StaticClaim(ClaimForm.RULES_EFFECTIVE(task.id), effective, engine),
    ]
    for invariant in task.invariants:
        claim_id = ClaimForm.RULES_KEEP_INVARIANT(task.id, invariant.id)
        settled.append(StaticClaim(claim_id, _invariant_violated(invariant, found), engine))
    return settled


def certificate_obligations(task: Task, claims: Iterable[CertificateClaim]) -> Iterator[Obligation]:
    """Make the claims by which the solver checks what was computed with diagrams.

    Args:
        task: the task.
        claims: the certificate of its loop.

    Yields:
        An obligation for each claim.
    """
    for number, claim in enumerate(claims):
        variables = tuple(Declared(one, task.span, range=bounds) for one, bounds in claim.variables)
        yield Obligation(
            id=ClaimForm.RULES_CERTIFIED(task.id, number),
            code="AE803",
            mode=ClaimMode.ALWAYS,
            space=VariableSpace(variables, claim.assumptions),
            conclusion=claim.conclusion,
            headline="undecided, so refused: the solver contradicts the analysis of the rules of "
            f"`{task.id}`: {claim.subject}",
            primary=SpanLabel(task.span),
            help=("please report this: it is a fault of AEROS, and not of the module",),
        )


def _rule_never_dispatched(ecm: Ecm, found: LoopFindings) -> Diagnostic | None:
    blocked = found.blocked_step()
    if blocked is None:
        return None
    rule, skill = blocked.rule, blocked.skill
    clauses = list(_preconditions(ecm, rule, skill))
    read = {name for term, _ in clauses for name in t.variables_of(term)}
    called = f"`{skill}`" if skill == rule.skill else f"`{skill}`, which provides `{rule.skill}`,"
    return Diagnostic(
        "AE801",
        f"the rules of `{found.system.task.id}` call {called} where its precondition does not hold",
        SpanLabel(rule.span, "called here"),
        tuple(SpanLabel(span, "does not hold then") for _, span in clauses),
        notes=(format_path(found.system, blocked.path), *_unsettled_notes(found, blocked.path, read)),
        help=("put a rule before it that makes the precondition true, or weaken the precondition",),
    )


def _preconditions(ecm: Ecm, rule: PlanningRule, name: str) -> Iterator[tuple[t.Term, SourceSpan]]:
    """Yield the precondition of an alternative with its place, if it has one."""
    for one in ecm.alternatives(rule.skill):
        if one.name == name and one.composition is not None and one.composition.precondition_span is not None:
            yield one.composition.precondition, one.composition.precondition_span
        elif one.name == name and one.composition is None:
            clause = ecm.callable_skills[name].precondition
            yield from () if clause is None else ((clause.term, clause.span),)


def _unsettled_notes(found: LoopFindings, path: LoopPath, read: Collection[str]) -> tuple[str, ...]:
    """Say which of the predicates in `read` a step on a path has left at either value."""
    skills = found.system.ecm.callable_skills
    names = [label.partition(" → ")[0] for label in reversed(path.labels)]
    note = unsettled_note(read, [(name, skills[name]) for name in names if name in skills])
    return () if note is None else (note,)


def _goal_unreachable(found: LoopFindings) -> Diagnostic | None:
    path = found.dead_end()
    if path is None:
        return None
    task, system = found.system.task, found.system
    rejection = system.rejection(system.plan(path.end))
    return Diagnostic(
        "AE802",
        f"the rules of `{task.id}` can lead to a state from which they never reach its goal",
        SpanLabel(task.span, "from there, no path of outcomes leads to the goal"),
        notes=(
            format_path(system, path),
            *_unsettled_notes(found, path, system.names),
            *([f"there, {rejection}"] if rejection else []),
            *(
                ["if a step names a capability, the same skill of it may run each time"]
                if found.has_choices
                else []
            ),
        ),
        help=("add a rule, a `between_tries` or an `on_failure` that leads out of that state",),
    )


def _invariant_violated(invariant: TaskInvariant, found: LoopFindings) -> Diagnostic | None:
    path = found.violation(invariant)
    if path is None:
        return None
    return Diagnostic(
        "AE804",
        f"`{invariant.id}` does not hold throughout `{found.system.task.id}`",
        SpanLabel(invariant.span, "does not hold then"),
        notes=(format_path(found.system, path),),
        help=("strengthen the preconditions of the skills on that path, or weaken the invariant",),
    )


def _analysis_undecided(task: Task, reason: str) -> Diagnostic:
    """Report a task that was not analysed as an error.

    A warning would let one number in a condition excuse the rules from every proof.
    """
    return Diagnostic(
        "AE803",
        f"undecided, so refused: the planning rules of `{task.id}` were not analysed: {reason}",
        SpanLabel(task.span),
        help=("declare a truth value with a `definition`, in site or module, and use that in the rules",),
    )


def _impossible_start(ecm: Ecm, task: Task, site: Site) -> Diagnostic | None:
    """Report a start that no state agrees with: proofs from there are about no run."""
    found = find_start_contradiction(ecm, task, site)
    if found is None:
        return None
    stated, other = ("true", "false") if found.stated else ("false", "true")
    values = ", ".join(f"{name} = {_shown(value)}" for name, value in found.values.items())
    return Diagnostic(
        "AE806",
        f"`initial` of `{task.id}` states that `{found.predicate}` is {stated}; by its definition "
        f"it is {other}",
        SpanLabel(task.span),
        notes=(
            f"`{found.predicate}` is defined as `{' '.join(found.definition.split())}`",
            *([f"`initial` also states {values}"] if values else []),
        ),
        help=(f"correct the values, or leave `{found.predicate}` out of `initial`",),
    )


def _shown(value: Any) -> str:
    """Write a stated value; numbers in SI units."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return f"({', '.join(map(_shown, value))})"
    return f"{float(value):g}" if isinstance(value, Fraction | float | int) else str(value)


def _task_without_rules(found: LoopFindings) -> Diagnostic | None:
    """Report a task whose goal holds at every start: a proof of rules that never run says nothing."""
    if not found.starts_at_goal():
        return None
    return Diagnostic(
        "AE805",
        f"`{found.system.task.id}` starts with its goal reached, so nothing is proved of its rules",
        SpanLabel(found.system.task.span),
        help=("correct the task's `initial`",),
    )
