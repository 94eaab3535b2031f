"""Reachable states of a task's closed loop, found breadth first so that traces are shortest."""

from __future__ import annotations

import itertools
import math
from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace

from aeros.spec.closed_loop.findings import BlockedStep, LoopPath
from aeros.spec.closed_loop.invocation import State
from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.closed_loop.transition_system import LoopState, Transition, TransitionSystem
from aeros.spec.model.ecm import Ecm, Task, TaskInvariant
from aeros.spec.model.site import Site


class UnlistedStatesError(StateSpaceError):
    """There are too many states to list them."""


MAX_STARTS = 4096
MAX_NODES = 30_000


@dataclass
class ReachableStates:
    """The reachable part of a transition system; implements `LoopFindings`.

    Attributes:
        system: the transition system.
        graph: nodes in breadth-first order, so that earlier ones are nearer to a start.  Each has the nodes
            from which a move of positive probability leads to it, with the agent's choice for that move and
            its case.
        predecessors: for each node but the starts, the node before it on a shortest path and the label of the
            move between them.
        through: states on the way of a composition that is run in one try, with the node before and the label
            of the move.
        ways: for each node the agent's choices there, each with the number of its moves of positive
            probability, by case.
    """

    system: TransitionSystem
    graph: dict[LoopState, list[tuple[LoopState, str, str]]] = field(default_factory=dict)
    predecessors: dict[LoopState, tuple[LoopState, str]] = field(default_factory=dict)
    through: dict[State, tuple[LoopState, str]] = field(default_factory=dict)
    ways: dict[LoopState, Mapping[str, Mapping[str, int]]] = field(default_factory=dict)

    def nodes_that_can_miss_goal(self) -> Iterator[LoopState]:
        """Find the nodes before a plan from which the agent's choices may keep it from the goal for ever.

        A node can reach the goal if each choice there has an outcome that leads to nodes that can reach it:
        to all of them if it leaves a predicate at either value.

        Returns:
            The nodes in phase `plan` that cannot reach the goal in this sense, nearest to a start first.
        """
        pending = [node for node in self.graph if node.phase == "reached"]
        hopeful = set(pending)
        open_: dict[LoopState, set[str]] = {}
        left: dict[tuple[LoopState, str, str], int] = {}
        while pending:
            for before, choice, case in self.graph[pending.pop()]:
                if before in hopeful:
                    continue
                if before not in open_:
                    open_[before] = set(self.ways[before])
                    for name, cases in self.ways[before].items():
                        left |= {(before, name, each): count for each, count in cases.items()}
                if case:
                    left[before, choice, case] -= 1
                    if left[before, choice, case]:
                        continue
                open_[before].discard(choice)
                if not open_[before]:
                    hopeful.add(before)
                    pending.append(before)
        return (node for node in self.graph if node.phase == "plan" and node not in hopeful)

    @property
    def has_choices(self) -> bool:
        """True if the agent chooses between skills somewhere."""
        return any(len(choices) > 1 for choices in self.ways.values())

    def blocked_step(self) -> BlockedStep | None:
        """Implement `LoopFindings.blocked_step`; the step is one of the nearest to a start."""
        for node in self.graph:
            blocked = self.system.blocked_step(node)
            if blocked is not None:
                return BlockedStep(self.path(node), *blocked)
        return None

    def dead_end(self) -> LoopPath | None:
        """Implement `LoopFindings.dead_end`; the state is one of the nearest to a start."""
        node = next(self.nodes_that_can_miss_goal(), None)
        return None if node is None else self.path(node)

    def violation(self, invariant: TaskInvariant) -> LoopPath | None:
        """Implement `LoopFindings.violation`; the state is one of the nearest to a start."""
        holds = self.system.condition(invariant.term)
        node = next((node for node in self.graph if not holds(node.state)), None)
        if node is not None:
            return self.path(node)
        for state, (before, label) in self.through.items():
            if not holds(state):
                to_it = self.path(before)
                return replace(to_it, end=state, inside=label.partition(" → ")[0])
        return None

    def starts_at_goal(self) -> bool:
        """Implement `LoopFindings.starts_at_goal`."""
        reached = self.system.condition(self.system.task.goal)
        return all(reached(node.state) for node in self.graph if node not in self.predecessors)

    def path(self, node: LoopState) -> LoopPath:
        """Find a shortest path from a start to a node.

        Args:
            node: a node of the graph.

        Returns:
            The path.
        """
        end, labels = node.state, list[str]()
        while node in self.predecessors:
            node, label = self.predecessors[node]
            labels += [label] if label else []
        return LoopPath(node.state, tuple(reversed(labels)), end)


def explore_task(ecm: Ecm, task: Task, site: Site) -> ReachableStates:
    """Explore the closed loop of a task from all its starts.

    Starts are the states that agree with the task's `initial`.  A predicate that it does not name may have
    any value at the start, and so may a parameter of a task: an instruction may say any.

    Args:
        ecm: module that declares the task.
        task: the task.
        site: site under which the module is elaborated.

    Returns:
        The reachable states.

    Raises:
        StateSpaceError: a variable has infinitely many values.
        UnlistedStatesError: there are more than `MAX_STARTS` starts or `MAX_NODES` nodes.
    """
    return explore_system(TransitionSystem(ecm, task, site))


def explore_system(system: TransitionSystem) -> ReachableStates:
    """Explore a transition system from all starts of its task, as `explore_task` does.

    Args:
        system: the transition system.

    Returns:
        The reachable states.

    Raises:
        UnlistedStatesError: there are more than `MAX_STARTS` starts or `MAX_NODES` nodes.
    """
    values = system.variables.starts(system.task.initial).values()
    if math.prod(map(len, values)) > MAX_STARTS:
        raise UnlistedStatesError("it has too many start states")
    facts = [system.condition(one) for one in system.variables.facts.equivalences(system.variables.variables)]
    combined = [*itertools.product(*values)]
    # Where no start agrees with the definitions, `initial` contradicts them (AE806), and the rules are shown.
    starts = [one for one in combined if all(holds(one) for holds in facts)] or combined
    reachable = ReachableStates(system)
    pending = deque(LoopState("plan", start) for start in starts)
    reachable.graph.update((start, []) for start in pending)
    while pending:
        node = pending.popleft()
        moves = system.transitions(node)
        reachable.ways[node] = _ways(moves)
        for move in moves:
            if move.target not in reachable.graph:
                if len(reachable.graph) >= MAX_NODES:
                    raise UnlistedStatesError("it has too many states")
                reachable.graph[move.target] = []
                reachable.predecessors[move.target] = (node, move.label)
                pending.append(move.target)
            for state in move.through:
                reachable.through.setdefault(state, (node, move.label))
            if move.probability:
                reachable.graph[move.target].append((node, move.choice, move.case))
    return reachable


def _ways(moves: Iterable[Transition]) -> Mapping[str, Mapping[str, int]]:
    """Count the moves of each choice by case, as `ReachableStates.ways` has them."""
    ways: dict[str, dict[str, int]] = {}
    for move in moves:
        cases = ways.setdefault(move.choice, {})
        if move.case and move.probability:
            cases[move.case] = cases.get(move.case, 0) + 1
    return ways
