"""Reachable states of a task's closed loop, found breadth first so that traces are shortest."""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field

from aeros.spec.closed_loop.invocation import State
from aeros.spec.closed_loop.transition_system import LoopState, StateSpaceError, TransitionSystem
from aeros.spec.model.ecm import Ecm, Task
from aeros.spec.model.site import Site
from aeros.spec.model.task_parameters import is_parameter

MAX_STARTS = 4096
MAX_NODES = 200_000


@dataclass
class ReachableStates:
    """The reachable part of a transition system.

    Attributes:
        system: the transition system.
        graph: nodes in breadth-first order, so that earlier ones are nearer to a start.  Each has the nodes
            from which a move of positive probability leads to it, with the agent's choice for that move and
            its case.
        predecessors: for each node but the starts, the node before it on a shortest path and the label of the
            move between them.
        through: states on the way of a composition that is run in one try, with the node before and the label
            of the move.
    """

    system: TransitionSystem
    graph: dict[LoopState, list[tuple[LoopState, str, str]]] = field(default_factory=dict)
    predecessors: dict[LoopState, tuple[LoopState, str]] = field(default_factory=dict)
    through: dict[State, tuple[LoopState, str]] = field(default_factory=dict)

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
                    moves = self.system.transitions(before)
                    open_[before] = {move.choice for move in moves}
                    for move in moves:
                        if move.case and move.probability:
                            key = (before, move.choice, move.case)
                            left[key] = left.get(key, 0) + 1
                if case:
                    left[before, choice, case] -= 1
                    if left[before, choice, case]:
                        continue
                open_[before].discard(choice)
                if not open_[before]:
                    hopeful.add(before)
                    pending.append(before)
        return (node for node in self.graph if node.phase == "plan" and node not in hopeful)

    def trace(self, node: LoopState) -> str:
        """Describe a shortest path from a start to a node, for people.

        Args:
            node: a node of the graph.

        Returns:
            One line for the start, for each move with a label, and for the state at the node.
        """
        lines = [f"then {self.format_state(node.state)}"]
        while node in self.predecessors:
            node, label = self.predecessors[node]
            lines += [label] if label else []
        return "\n".join(["for example:", f"start with {self.format_state(node.state)}", *reversed(lines)])

    def format_state(self, state: State) -> str:
        """Format a state as a manifest writes it.

        Args:
            state: values of the predicates, in the order of `system.names`.

        Returns:
            `NAME = VALUE` for each predicate, separated by commas.
        """
        values = zip(self.system.names, state, strict=True)
        return ", ".join(f"{name} = {str(value).lower()}" for name, value in values)


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
        StateSpaceError: a predicate has infinitely many values, or there are more than `MAX_STARTS` starts or
            `MAX_NODES` nodes.
    """
    system = TransitionSystem(ecm, task, site)
    domains = (
        (task.initial[name],) if name in task.initial and not is_parameter(site.state[name]) else domain
        for name, domain in zip(system.names, system.domains, strict=True)
    )
    starts = [*itertools.islice(itertools.product(*domains), MAX_STARTS + 1)]
    if len(starts) > MAX_STARTS:
        raise StateSpaceError("it has too many start states")
    reachable = ReachableStates(system)
    pending = deque(LoopState("plan", start) for start in starts)
    reachable.graph.update((start, []) for start in pending)
    while pending:
        node = pending.popleft()
        for move in system.transitions(node):
            if move.target not in reachable.graph:
                if len(reachable.graph) >= MAX_NODES:
                    raise StateSpaceError("it has too many states")
                reachable.graph[move.target] = []
                reachable.predecessors[move.target] = (node, move.label)
                pending.append(move.target)
            for state in move.through:
                reachable.through.setdefault(state, (node, move.label))
            if move.probability:
                reachable.graph[move.target].append((node, move.choice, move.case))
    return reachable
