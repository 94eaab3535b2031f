"""Everything that can be reached in a task's closed loop, breadth first, so that traces are shortest."""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field

from aeros.spec.closed_loop.invocation import State
from aeros.spec.closed_loop.transition_system import Node, NotExploredError, TransitionSystem
from aeros.spec.model.model import Ecm, Site, Task

MAX_STARTS = 4096
MAX_NODES = 200_000


@dataclass
class Exploration:
    """The reachable part of a transition system.

    graph: nodes in breadth-first order, so that what comes first is nearest to a start, each with the
        nodes from which a move of any probability leads to it, and the agent's choice that it takes there.
    came_from: of each node but the starts, the node before it on a shortest way, and what happened.
    """

    system: TransitionSystem
    graph: dict[Node, list[tuple[Node, str]]] = field(default_factory=dict)
    came_from: dict[Node, tuple[Node, str]] = field(default_factory=dict)

    def without_way_to_goal(self) -> Iterator[Node]:
        """Every node at which a plan is due, and the agent may choose so that the goal is never reached.

        A node has a way to it if each choice there has an outcome that leads to a node that has one.
        """
        pending = [node for node in self.graph if node.phase == "reached"]
        hopeful = set(pending)
        open_: dict[Node, set[str]] = {}
        while pending:
            for before, choice in self.graph[pending.pop()]:
                if before in hopeful:
                    continue
                if before not in open_:
                    open_[before] = {move.choice for move in self.system.moves(before)}
                open_[before].discard(choice)
                if not open_[before]:
                    hopeful.add(before)
                    pending.append(before)
        return (node for node in self.graph if node.phase == "plan" and node not in hopeful)

    def trace(self, node: Node) -> str:
        """A shortest way from a start to `node`, for people."""
        told = [f"then {self.shown(node.state)}"]
        while node in self.came_from:
            node, said = self.came_from[node]
            told += [said] if said else []
        return "\n".join(["for example:", f"start with {self.shown(node.state)}", *reversed(told)])

    def shown(self, state: State) -> str:
        """The values of `state`, as a manifest writes them."""
        values = zip(self.system.names, state, strict=True)
        return ", ".join(f"{name} = {str(value).lower()}" for name, value in values)


def explore(ecm: Ecm, task: Task, site: Site) -> Exploration:
    """Everything that can be reached from the starts of `task`; raises `NotExploredError`.

    Starts are the states that agree with `initial`; a predicate it does not name may have any value.
    """
    system = TransitionSystem(ecm, task, site)
    domains = (
        (task.initial[name],) if name in task.initial else domain
        for name, domain in zip(system.names, system.domains, strict=True)
    )
    starts = [*itertools.islice(itertools.product(*domains), MAX_STARTS + 1)]
    if len(starts) > MAX_STARTS:
        raise NotExploredError("it has too many states to start from")
    found = Exploration(system)
    pending = deque(Node("plan", start) for start in starts)
    found.graph.update((start, []) for start in pending)
    while pending:
        node = pending.popleft()
        for move in system.moves(node):
            if move.target not in found.graph:
                if len(found.graph) >= MAX_NODES:
                    raise NotExploredError("it has too many states")
                found.graph[move.target] = []
                found.came_from[move.target] = (node, move.said)
                pending.append(move.target)
            if move.probability:
                found.graph[move.target].append((node, move.choice))
    return found
