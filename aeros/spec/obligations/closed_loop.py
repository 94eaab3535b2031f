"""Claims about a task's planning rules, over every path of every declared outcome.

The agent's loop (`aeros.agent.pursuit`) is explored as a finite transition system over the task's
predicates: it plans from the measured state, runs the steps in order, retries with `on_failure`
between tries, and plans again when a step fails for good or the plan is exhausted.  Claimed is

- dispatch: whenever a step of a plan comes to its first try, its skill's precondition holds;
- progress: from every state that can be reached, the goal can be reached.

A refutation is a trace of steps and outcomes from a start.  Starts are the states that agree with the
task's `initial`; a predicate it does not name may have any value.  Effects of an outcome happen, and
nothing else changes: the supervisor records a broken assumption where that is not what is measured.
Not modelled: the cap on re-plans (progress is possible, not certain); predicates that change by
themselves.
"""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, Literal

import networkx as nx

from aeros.spec.diagnostics import Diagnostic, Label, Severity
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import holds
from aeros.spec.expr.types import BoolType, EnumType
from aeros.spec.model import Ecm, PlanningRule, Site, Skill, Task
from aeros.spec.obligations.obligation import Settled

MAX_STARTS = 4096
MAX_NODES = 200_000

State = tuple[Any, ...]
"""A value for each predicate of the task, in the order of `_Loop.names`."""


@dataclass(frozen=True, slots=True)
class Node:
    """Where the loop is.

    phase: `plan` (about to plan), `try` or `recover` (of the first step of `remaining`), or `end`.
    remaining: the rules, by index, still to be run of the current plan.
    tries: of the current step so far.
    """

    phase: Literal["plan", "try", "recover", "end"]
    state: State
    remaining: tuple[int, ...] = ()
    tries: int = 0


END = Node("end", ())
"""The goal is measured."""


@dataclass
class _Loop:
    """The transition system of one task.

    graph: in breadth-first order, so that what comes first is nearest to a start.
    came_from: of each node but the starts, the node before it on a shortest way, and what happened.
    undispatched: nodes at which a step is due whose precondition does not hold, and its skill.
    """

    ecm: Ecm
    task: Task
    names: tuple[str, ...]
    graph: nx.DiGraph[Node] = field(default_factory=nx.DiGraph)
    came_from: dict[Node, tuple[Node, str]] = field(default_factory=dict)
    undispatched: dict[Node, str] = field(default_factory=dict)

    def environment(self, state: State) -> dict[str, Any]:
        return dict(zip(self.names, state, strict=True))

    def holds(self, term: t.Term, state: State) -> bool:
        return holds(term, self.environment(state))

    def can_start(self, skill: Skill, state: State) -> bool:
        """Whether the precondition is measured; one on inputs alone is not judged here."""
        precondition = skill.precondition
        return precondition is None or self.holds(precondition.term, state)

    def after(self, skill: Skill, state: State) -> Iterator[tuple[str, State, bool]]:
        """Each outcome that can happen: its name, the state after it, whether it is a failure."""
        for outcome in skill.outcomes.values():
            if outcome.probability != 0:
                changed = {**self.environment(state), **outcome.effects}
                yield outcome.id, tuple(changed[name] for name in self.names), outcome.failure

    def successors(self, node: Node) -> Iterator[tuple[Node, str]]:
        """Each node that may come next, and what happened on the way."""
        if node == END:
            return
        if self.holds(self.task.goal, node.state):
            yield END, ""
        elif node.phase == "plan":
            steps = tuple(
                index for index, rule in enumerate(self.task.rules) if not self.holds(rule.unless, node.state)
            )
            if steps:
                yield Node("try", node.state, steps), ""
        elif not node.remaining:
            yield Node("plan", node.state), ""
        else:
            yield from self._step(node, self.task.rules[node.remaining[0]])

    def _step(self, node: Node, rule: PlanningRule) -> Iterator[tuple[Node, str]]:
        if self.holds(rule.unless, node.state):
            yield Node("try", node.state, node.remaining[1:]), ""
            return
        if node.phase == "recover":
            yield from self._recover(node, rule)
            return
        skill = self.ecm.skills[rule.skill]
        if not self.can_start(skill, node.state):
            if node.tries == 0:
                self.undispatched[node] = rule.skill
            yield Node("plan", node.state), ""
            return
        for outcome, state, failure in self.after(skill, node.state):
            said = f"{rule.skill} → {outcome}"
            if not failure:
                yield Node("try", state, node.remaining[1:]), said
            elif node.tries < rule.retry:
                yield Node("recover", state, node.remaining, node.tries + 1), said
            else:
                yield Node("plan", state), said

    def _recover(self, node: Node, rule: PlanningRule) -> Iterator[tuple[Node, str]]:
        """`on_failure`, which does no harm by not starting; then the next try."""
        skill = None if rule.on_failure is None else self.ecm.skills[rule.on_failure]
        if skill is None or not self.can_start(skill, node.state):
            yield Node("try", node.state, node.remaining, node.tries), ""
            return
        for outcome, state, _ in self.after(skill, node.state):
            yield Node("try", state, node.remaining, node.tries), f"{skill.id} → {outcome}"

    def explore(self, starts: Iterable[State]) -> bool:
        """Build the graph of everything reachable; False if it is larger than `MAX_NODES`."""
        pending = deque(Node("plan", start) for start in starts)
        self.graph.add_nodes_from(pending)
        while pending:
            node = pending.popleft()
            for successor, said in self.successors(node):
                if successor not in self.graph:
                    if len(self.graph) >= MAX_NODES:
                        return False
                    pending.append(successor)
                    self.came_from[successor] = (node, said)
                self.graph.add_edge(node, successor)
        return True

    def trace(self, node: Node) -> str:
        """A shortest way from a start to `node`, for people."""
        told = [f"then {self._shown(node.state)}"]
        while node in self.came_from:
            node, said = self.came_from[node]
            told += [said] if said else []
        return "\n".join(["for example:", f"start with {self._shown(node.state)}", *reversed(told)])

    def _shown(self, state: State) -> str:
        values = self.environment(state).items()
        return ", ".join(f"{name} = {str(value).lower()}" for name, value in values)


def closed_loop_obligations(ecm: Ecm, site: Site) -> Iterator[Settled]:
    """Every claim of group closed-loop about the tasks of `ecm`."""
    for task in ecm.tasks.values():
        yield from _task_obligations(ecm, site, task)


def _task_obligations(ecm: Ecm, site: Site, task: Task) -> Iterator[Settled]:
    identity = f"closed-loop/{task.id}"
    names = _predicates(ecm, task)
    domains = [_domain(site, task, name) for name in names]
    unbounded = [name for name, domain in zip(names, domains, strict=True) if domain is None]
    if unbounded:
        yield Settled(
            f"{identity}/analysed",
            _not_analysed(task, f"it depends on `{unbounded[0]}`, which is no predicate"),
        )
        return
    starts = list(itertools.islice(itertools.product(*(domain or () for domain in domains)), MAX_STARTS + 1))
    loop = _Loop(ecm, task, names)
    if len(starts) > MAX_STARTS or not loop.explore(starts):
        yield Settled(f"{identity}/analysed", _not_analysed(task, "it has too many states"))
        return
    yield Settled(f"{identity}/dispatch", _undispatched(loop))
    yield Settled(f"{identity}/progress", _stuck(loop))


def _predicates(ecm: Ecm, task: Task) -> tuple[str, ...]:
    """Every state variable that the task's rules, their skills or its goal speak of."""
    used = {rule.skill for rule in task.rules} | {rule.on_failure for rule in task.rules if rule.on_failure}
    skills = [ecm.skills[name] for name in sorted(used)]
    conditions = [task.goal, *(rule.unless for rule in task.rules)]
    conditions += [skill.precondition.term for skill in skills if skill.precondition is not None]
    names = {name for condition in conditions for name in t.variables_of(condition)}
    names |= {name for skill in skills for outcome in skill.outcomes.values() for name in outcome.effects}
    return tuple(sorted(names))


def _domain(site: Site, task: Task, name: str) -> tuple[Any, ...] | None:
    """The values that `name` may start with; None where it is no predicate."""
    declared = site.state.get(name)
    match None if declared is None else declared.variable.type:
        case BoolType():
            values: tuple[Any, ...] = (False, True)
        case EnumType(members=members):
            values = members
        case _:
            return None
    return (task.initial[name],) if name in task.initial else values


def _undispatched(loop: _Loop) -> Diagnostic | None:
    if not loop.undispatched:
        return None
    node, name = next(iter(loop.undispatched.items()))
    precondition = loop.ecm.skills[name].precondition
    return Diagnostic(
        "AE801",
        f"the rules of `{loop.task.id}` call `{name}` where its precondition does not hold",
        Label(loop.task.rules[node.remaining[0]].span, "called here"),
        () if precondition is None else (Label(precondition.span, "does not hold then"),),
        notes=(loop.trace(node),),
        help=("put a rule before it that brings the precondition about, or weaken the precondition",),
    )


def _stuck(loop: _Loop) -> Diagnostic | None:
    hopeful = nx.ancestors(loop.graph, END) if END in loop.graph else set()
    stuck = next((node for node in loop.graph if node.phase == "plan" and node not in hopeful), None)
    if stuck is None:
        return None
    return Diagnostic(
        "AE802",
        f"the rules of `{loop.task.id}` can come to a state from which they never reach its goal",
        Label(loop.task.span, "from there, no path of outcomes leads to the goal"),
        notes=(loop.trace(stuck),),
        help=("add a rule, or an `on_failure`, that leads out of that state",),
    )


def _not_analysed(task: Task, why: str) -> Diagnostic:
    return Diagnostic(
        "AE803",
        f"the planning rules of `{task.id}` were not analysed: {why}",
        Label(task.span),
        severity=Severity.WARNING,
    )
