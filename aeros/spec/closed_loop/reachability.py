"""Everything that can be reached in a task's closed loop, breadth first, so that traces are shortest."""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field

from aeros.spec.closed_loop.invocation import State
from aeros.spec.closed_loop.transition_system import LoopState, StateSpaceError, TransitionSystem
from aeros.spec.model.model import Ecm, Site, Task

MAX_STARTS = 4096
MAX_NODES = 200_000


@dataclass
class ReachableStates:
    """The reachable part of a transition system.

    graph: nodes in breadth-first order, so that what comes first is nearest to a start, each with the
        nodes from which a move of any probability leads to it, and the agent's choice that it takes there.
    came_from: of each node but the starts, the node before it on a shortest way, and what happened.
    """

    system: TransitionSystem
    graph: dict[LoopState, list[tuple[LoopState, str]]] = field(default_factory=dict)
    predecessors: dict[LoopState, tuple[LoopState, str]] = field(default_factory=dict)

    def nodes_that_can_miss_goal(self) -> Iterator[LoopState]:
        """Every node at which a plan is due, and the agent may choose so that the goal is never reached.

        A node has a way to it if each choice there has an outcome that leads to a node that has one.
        """
        pending = [node for node in self.graph if node.phase == "reached"]
        hopeful = set(pending)
        open_: dict[LoopState, set[str]] = {}
        while pending:
            for before, choice in self.graph[pending.pop()]:
                if before in hopeful:
                    continue
                if before not in open_:
                    open_[before] = {move.choice for move in self.system.transitions(before)}
                open_[before].discard(choice)
                if not open_[before]:
                    hopeful.add(before)
                    pending.append(before)
        return (node for node in self.graph if node.phase == "plan" and node not in hopeful)

    def trace(self, node: LoopState) -> str:
        """A shortest way from a start to `node`, for people."""
        told = [f"then {self.format_state(node.state)}"]
        while node in self.predecessors:
            node, said = self.predecessors[node]
            told += [said] if said else []
        return "\n".join(["for example:", f"start with {self.format_state(node.state)}", *reversed(told)])

    def format_state(self, state: State) -> str:
        """The values of `state`, as a manifest writes them."""
        values = zip(self.system.names, state, strict=True)
        return ", ".join(f"{name} = {str(value).lower()}" for name, value in values)


def explore_task(ecm: Ecm, task: Task, site: Site) -> ReachableStates:
    """Everything that can be reached from the starts of `task`; raises `StateSpaceError`.

    Starts are the states that agree with `initial`; a predicate it does not name may have any value.
    """
    system = TransitionSystem(ecm, task, site)
    domains = (
        (task.initial[name],) if name in task.initial else domain
        for name, domain in zip(system.names, system.domains, strict=True)
    )
    starts = [*itertools.islice(itertools.product(*domains), MAX_STARTS + 1)]
    if len(starts) > MAX_STARTS:
        raise StateSpaceError("it has too many states to start from")
    found = ReachableStates(system)
    pending = deque(LoopState("plan", start) for start in starts)
    found.graph.update((start, []) for start in pending)
    while pending:
        node = pending.popleft()
        for move in system.transitions(node):
            if move.target not in found.graph:
                if len(found.graph) >= MAX_NODES:
                    raise StateSpaceError("it has too many states")
                found.graph[move.target] = []
                found.predecessors[move.target] = (node, move.label)
                pending.append(move.target)
            if move.probability:
                found.graph[move.target].append((node, move.choice))
    return found
