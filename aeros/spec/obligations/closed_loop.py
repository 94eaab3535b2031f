"""Claims about a task's planning rules, over every path of every declared outcome.

The claims are about the agent's loop, explored as the transition system of `aeros.spec.closed_loop`:

- dispatch: whenever a step of a plan is due for its first try, its skill's precondition holds; where it names
  a capability, the precondition of every provider holds;
- progress: from every reachable state the goal can be reached, whichever providers are chosen;
- effective: some state agrees with the declared start, by the definitions of predicates, and not all such
  states are at the goal;
- each invariant of the task: it holds in every reachable state, the last included.

A refutation is a trace of steps and outcomes from a start.
Not modelled: the cap on re-plans (progress is possible, not certain; `aeros predict` says how likely);
predicates that change by themselves. A predicate that a step leaves at either value is branched on.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from fractions import Fraction
from typing import Any

from aeros.spec.closed_loop.reachability import ReachableStates, explore_task
from aeros.spec.closed_loop.transition_system import LoopState, StateSpaceError
from aeros.spec.consequences.start_values import find_start_contradiction
from aeros.spec.consequences.words import unsettled_note
from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.expr import terms as t
from aeros.spec.model.ecm import Ecm, PlanningRule, Task, TaskInvariant
from aeros.spec.model.site import Site
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.verdicts import StaticClaim


def closed_loop_obligations(ecm: Ecm, site: Site) -> Iterator[StaticClaim]:
    """Make every claim of group closed-loop about the tasks of a module.

    Args:
        ecm: the module.
        site: site under which it is elaborated.

    Yields:
        The claims, each settled by exploring the task's reachable states.
    """
    for task in ecm.tasks.values():
        try:
            explored = explore_task(ecm, task, site)
        except StateSpaceError as error:
            yield StaticClaim(ClaimForm.RULES_ANALYSED(task.id), _analysis_undecided(task, str(error)))
            continue
        yield StaticClaim(ClaimForm.RULES_DISPATCH(task.id), _rule_never_dispatched(ecm, explored))
        yield StaticClaim(ClaimForm.RULES_PROGRESS(task.id), _goal_unreachable(explored))
        effective = _impossible_start(ecm, task, site) or _task_without_rules(explored)
        yield StaticClaim(ClaimForm.RULES_EFFECTIVE(task.id), effective)
        for invariant in task.invariants:
            claim_id = ClaimForm.RULES_KEEP_INVARIANT(task.id, invariant.id)
            yield StaticClaim(claim_id, _invariant_violated(invariant, explored))


def _rule_never_dispatched(ecm: Ecm, explored: ReachableStates) -> Diagnostic | None:
    for node in explored.graph:
        blocked = explored.system.blocked_step(node)
        if blocked is not None:
            rule, skill = blocked
            clauses = list(_preconditions(ecm, rule, skill))
            read = {name for term, _ in clauses for name in t.variables_of(term)}
            called = f"`{skill}`" if skill == rule.skill else f"`{skill}`, which provides `{rule.skill}`,"
            return Diagnostic(
                "AE801",
                f"the rules of `{explored.system.task.id}` call {called} "
                "where its precondition does not hold",
                SpanLabel(rule.span, "called here"),
                tuple(SpanLabel(span, "does not hold then") for _, span in clauses),
                notes=(explored.trace(node), *_unsettled_notes(explored, node, read)),
                help=("put a rule before it that makes the precondition true, or weaken the precondition",),
            )
    return None


def _preconditions(ecm: Ecm, rule: PlanningRule, name: str) -> Iterator[tuple[t.Term, SourceSpan]]:
    """Yield the precondition of an alternative with its place, if it has one."""
    for one in ecm.alternatives(rule.skill):
        if one.name == name and one.composition is not None and one.composition.precondition_span is not None:
            yield one.composition.precondition, one.composition.precondition_span
        elif one.name == name and one.composition is None:
            clause = ecm.callable_skills[name].precondition
            yield from () if clause is None else ((clause.term, clause.span),)


def _unsettled_notes(explored: ReachableStates, node: LoopState, read: Collection[str]) -> tuple[str, ...]:
    """Say which of the predicates in `read` a step on the way to a node has left at either value."""
    skills, steps = explored.system.ecm.callable_skills, []
    while node in explored.predecessors:
        node, label = explored.predecessors[node]
        name = label.partition(" → ")[0]
        steps += [(name, skills[name])] if name in skills else []
    note = unsettled_note(read, steps)
    return () if note is None else (note,)


def _goal_unreachable(explored: ReachableStates) -> Diagnostic | None:
    node = next(explored.nodes_that_can_miss_goal(), None)
    if node is None:
        return None
    task, system = explored.system.task, explored.system
    rejection = system.rejection(system.plan(node.state))
    chosen = any(len({move.choice for move in system.transitions(one)}) > 1 for one in explored.graph)
    return Diagnostic(
        "AE802",
        f"the rules of `{task.id}` can lead to a state from which they never reach its goal",
        SpanLabel(task.span, "from there, no path of outcomes leads to the goal"),
        notes=(
            explored.trace(node),
            *_unsettled_notes(explored, node, system.names),
            *([f"there, {rejection}"] if rejection else []),
            *(["if a step names a capability, the same skill of it may run each time"] if chosen else []),
        ),
        help=("add a rule, a `between_tries` or an `on_failure` that leads out of that state",),
    )


def _invariant_violated(invariant: TaskInvariant, explored: ReachableStates) -> Diagnostic | None:
    holds = explored.system.condition(invariant.term)
    node = next((node for node in explored.graph if not holds(node.state)), None)
    on_the_way = next((one for one in explored.through.items() if not holds(one[0])), None)
    if node is None and on_the_way is None:
        return None
    trace = ""
    if node is not None:
        trace = explored.trace(node)
    elif on_the_way is not None:
        state, (before, label) = on_the_way
        name = label.partition(" → ")[0]
        trace = f"{explored.trace(before)}\n{name}, on its way\nthen {explored.format_state(state)}"
    return Diagnostic(
        "AE804",
        f"`{invariant.id}` does not hold throughout `{explored.system.task.id}`",
        SpanLabel(invariant.span, "does not hold then"),
        notes=(trace,),
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
        help=("declare a state variable of type bool for the condition, in site or module, and use that",),
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


def _task_without_rules(explored: ReachableStates) -> Diagnostic | None:
    """Report a task whose goal holds at every start: a proof of rules that never run says nothing."""
    reached = explored.system.condition(explored.system.task.goal)
    starts = (node for node in explored.graph if node not in explored.predecessors)
    if not all(reached(node.state) for node in starts):
        return None
    return Diagnostic(
        "AE805",
        f"`{explored.system.task.id}` starts with its goal reached, so nothing is proved of its rules",
        SpanLabel(explored.system.task.span),
        help=("correct the task's `initial`",),
    )
