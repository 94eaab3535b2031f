"""`aeros graph`: draw a task's planning rules, the states of its closed loop, or a composition."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING

from aeros.apps.drawings.composition import composition_drawing
from aeros.apps.drawings.drawing import Diagram, Edge, Node, dot, mermaid, svg
from aeros.cli.arguments import add_command, existing_path
from aeros.cli.author.module_argument import add_module, read_module, select_declared
from aeros.cli.module_settings import add_module_settings, module_configurations
from aeros.cli.terminal.streams import print_data
from aeros.exit_codes import Exit, UsageError
from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.closed_loop.reachability import ReachableStates, explore_task
from aeros.spec.closed_loop.transition_system import LoopState as LoopNode
from aeros.spec.model.ecm import Ecm, PlanningRule, Task

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

MAX_NODES = 800
"""Largest number of nodes in a diagram; larger ones are not legible."""

_FORMATS = {"mermaid": mermaid, "dot": dot, "svg": svg}
_EXAMPLES = """\
rules: the planning rules in order, each with the condition that skips it, its retries and its recovery.
closed-loop: the states that the agent may measure when it plans or runs a step, and every declared
outcome between them, as `aeros verify` explores them.  Dashed: a failure.
composition: steps and handlers, the outcomes that lead from one to the next, conditions, and the
points where parallel branches split and join.

examples:
  aeros graph ecms/make_dumplings                                     for a Markdown page
  aeros graph ecms/make_dumplings --format svg > rules.svg
  aeros graph ecms/make_dumplings --kind closed-loop --format dot | dot -Tpdf > loop.pdf
  aeros graph ecms/fetch_object --kind composition
"""


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "graph", __doc__, _EXAMPLES)
    add_module(parser)
    parser.add_argument("--task", help="the task (default: the module's first)")
    parser.add_argument("--composition", help="the composition (default: the module's first)")
    add_module_settings(parser)
    parser.add_argument(
        "--site", type=existing_path, help="the site file (default: the reference site, a Panda cell)"
    )
    parser.add_argument(
        "--kind",
        choices=("rules", "closed-loop", "composition"),
        help="default: rules, or composition if --composition is given",
    )
    parser.add_argument("--format", choices=tuple(_FORMATS), default="mermaid", help="default: mermaid")
    parser.set_defaults(command=_command)


def _command(arguments: argparse.Namespace) -> Exit:
    ecm, site = read_module(
        arguments.module, arguments.ecms or (), arguments.site, module_configurations(arguments)
    )
    kind = arguments.kind or ("rules" if arguments.composition is None else "composition")
    if kind != "composition" and arguments.composition is not None:
        raise UsageError(f"--composition does not go with --kind {kind}")
    if kind == "composition":
        composition = select_declared(ecm, "composition", ecm.compositions, arguments.composition)
        drawing = composition_drawing(ecm, composition)
    else:
        task = select_declared(ecm, "task", ecm.tasks, arguments.task)
        drawing = rules_drawing(ecm, task)
        if kind == "closed-loop":
            try:
                drawing = closed_loop_drawing(ecm, explore_task(ecm, task, site))
            except StateSpaceError as why:
                print(f"aeros: the closed loop of `{task.id}` cannot be drawn: {why}", file=sys.stderr)
                return Exit.REJECTED
    print_data(_FORMATS[arguments.format](drawing), end="")
    return Exit.SUCCESS


def rules_drawing(ecm: Ecm, task: Task) -> Diagram:
    """Draw the planning rules of a task, in the order in which the planner reads them.

    Args:
        ecm: The module.
        task: A task of the module.

    Returns:
        The diagram, from start to goal.
    """
    nodes = [Node("start", (task.id,), "start")]
    edges = []
    for index, rule in enumerate(task.rules):
        step = f"step{index}"
        nodes.append(Node(step, (f"{index + 1}. {rule.skill}", *_rule_text(rule))))
        edges.append(Edge("start" if index == 0 else f"step{index - 1}", step))
        if rule.between_tries is not None:
            recovery = f"recovery{index}"
            nodes.append(Node(recovery, (rule.between_tries,), "state"))
            edges.append(Edge(step, recovery, "on failure", dashed=True))
            edges.append(Edge(recovery, step, "try again", dashed=True))
        elif rule.retry:
            edges.append(Edge(step, step, "try again", dashed=True))
        if rule.on_failure is not None:
            reset = f"reset{index}"
            nodes.append(Node(reset, (rule.on_failure,), "state"))
            edges.append(Edge(step, reset, "after the last failure", dashed=True))
            edges.append(Edge(reset, "start", "plan again", dashed=True))
    nodes.append(Node("goal", (f"goal: {task.goal_text}",), "goal"))
    edges.append(Edge(f"step{len(task.rules) - 1}", "goal"))
    return Diagram(f"{ecm.id}: planning rules of {task.id}", tuple(nodes), tuple(edges))


def _rule_text(rule: PlanningRule) -> Iterator[str]:
    yield f"unless {rule.text}"
    if rule.retry:
        yield f"at most {rule.retry + 1} tries"


def closed_loop_drawing(ecm: Ecm, explored: ReachableStates) -> Diagram:
    """Draw every state in which the agent plans, tries or recovers, and the transitions between them.

    Args:
        ecm: The module.
        explored: The reachable states of one of its tasks.

    Returns:
        The diagram.

    Raises:
        StateSpaceError: There are more than `MAX_NODES` states.
    """
    if len(explored.graph) > MAX_NODES:
        raise StateSpaceError(f"it has {len(explored.graph)} nodes; at most {MAX_NODES} are drawn")
    names = {node: f"n{index}" for index, node in enumerate(explored.graph)}
    stuck = set(explored.nodes_that_can_miss_goal())
    nodes, edges = [], []
    for node, name in names.items():
        nodes.append(_loop_node(explored, node, name, stuck=node in stuck))
        for move in explored.system.transitions(node):
            failed = move.role in ("step", "retry") and move.target.phase in ("plan", "recover", "reset")
            edges.append(Edge(name, names[move.target], move.label, dashed=failed))
    return Diagram(
        f"{ecm.id}: closed loop of {explored.system.task.id}", tuple(nodes), tuple(dict.fromkeys(edges))
    )


def _loop_node(explored: ReachableStates, node: LoopNode, name: str, *, stuck: bool) -> Node:
    task = explored.system.task
    if node.phase == "reached":
        return Node(name, (f"goal: {task.goal_text}", *_state_text(explored, node)), "goal")
    doing: str = node.phase
    if node.remaining_rules:
        rule = task.rules[node.remaining_rules[0]]
        doing = {
            "try": f"try {rule.skill}",
            "recover": f"recover by {rule.between_tries or 'trying again'}",
            "reset": f"recover by {rule.on_failure}, then plan again",
        }[node.phase]
        doing += f" (try {node.tries + 1})" if node.tries and node.phase != "reset" else ""
    elif node.phase == "try":
        doing = "plan exhausted"
    lines = (doing, *_state_text(explored, node))
    if stuck or node.phase == "rejected":
        return Node(name, lines, "stuck")
    return Node(name, lines, "state" if node in explored.predecessors else "start")


def _state_text(explored: ReachableStates, node: LoopNode) -> list[str]:
    """Return the values of a node's state; variables that are false are left out."""
    values = zip(explored.system.names, node.state, strict=True)
    return [name if value is True else f"{name} = {value}" for name, value in values if value is not False]
