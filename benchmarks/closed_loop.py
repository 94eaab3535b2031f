"""Measure the time of claims about a long closed loop: `python -m benchmarks.closed_loop`.

One task of N rules in a row: rule i runs a skill that may fail, is tried twice, and whose precondition is
that the skill before it has succeeded.  So there are N + 1 states, and in each a plan of all that is left.
The claims are safety (each step's precondition holds when it is called) and progress (from every state that
can be reached, the goal can be reached).  Both read what is explored once, so three times are printed.

The agent itself accepts no plan of more than `MAX_PLAN_STEPS` steps, and `aeros verify` proves the loop with
that limit; here the limit is lifted, as the exploration is measured.
"""

from __future__ import annotations

import statistics
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from aeros.spec.closed_loop import transition_system
from aeros.spec.closed_loop.reachability import ReachableStates, explore_task
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL
from aeros.spec.model.ecm import ActionCondition, Ecm, Outcome, PlanningRule, Task
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path
from benchmarks.command import build_parser, print_json

_TEMPLATE = Path(__file__).parents[1] / "ecms" / "clean_table"


def build_loop(steps: int) -> tuple[Ecm, Task, Site]:
    """Build a module whose one task has `steps` rules in a row."""
    site = load_site(reference_site_path(), Diagnostics())
    loaded = None if site is None else load_ecm(_TEMPLATE, site, Diagnostics())
    if site is None or loaded is None:
        raise SystemExit("the reference site or `ecms/clean_table` cannot be read")
    ecm = loaded.ecm
    skill, task = ecm.skills["wipe"], ecm.tasks["clean_table"]
    measured = ecm.state["clean_table.table_wiped"]
    done = [t.Variable(f"done_{index}", BOOL, t.VariableRole.STATE) for index in range(steps)]
    skills, rules = {}, []
    for index, variable in enumerate(done):
        name = f"step_{index}"
        before = ActionCondition(done[index - 1], "", skill.span) if index else None
        outcomes = {
            "done": Outcome("done", {variable.name: True}, failure=False, probability=None, duration=None),
            "failed": Outcome("failed", {}, failure=True, probability=None, duration=None),
        }
        skills[name] = replace(skill, id=name, inputs={}, precondition=before, outcomes=outcomes)
        rules.append(PlanningRule(variable, variable.name, name, {}, 1, None, None, skill.span))
    initial = {variable.name: False for variable in done}
    long = replace(task, goal=t.And(tuple(done)), rules=tuple(rules), initial=initial, invariants=())
    state = {variable.name: replace(measured, variable=variable) for variable in done}
    return replace(ecm, skills=skills, tasks={long.id: long}), long, replace(site, state=state)


def measure(steps: int) -> dict[str, Any]:
    """Measure the seconds for exploring, safety and progress, and count what was explored."""
    ecm, task, site = build_loop(steps)
    before = transition_system.MAX_PLAN_STEPS
    transition_system.MAX_PLAN_STEPS = steps  # type: ignore[misc]
    try:
        started = time.perf_counter()
        explored = explore_task(ecm, task, site)
        explored_at = time.perf_counter()
        safe = not any(explored.system.blocked_step(node) for node in explored.graph)
        safe_at = time.perf_counter()
        progress = next(explored.nodes_that_can_miss_goal(), None) is None
        ended = time.perf_counter()
    finally:
        transition_system.MAX_PLAN_STEPS = before  # type: ignore[misc]
    if not (safe and progress and _states(explored) == steps + 1):
        raise SystemExit("the loop was not what it is meant to be")
    return {
        "steps": steps,
        "nodes": len(explored.graph),
        "explored": explored_at - started,
        "safety": safe_at - explored_at,
        "progress": ended - safe_at,
    }


def _states(explored: ReachableStates) -> int:
    return len({node.state for node in explored.graph})


def main() -> None:
    """Measure, and print a table or JSON."""
    parser = build_parser(__doc__, quick="one small loop")
    parser.add_argument("--steps", type=int, nargs="+", default=[10, 100, 1000])
    parser.add_argument("--runs", type=int, default=3)
    arguments = parser.parse_args()
    rows = []
    for steps in [5] if arguments.quick else arguments.steps:
        runs = [measure(steps) for _ in range(1 if arguments.quick else arguments.runs)]
        rows.append({key: statistics.median(run[key] for run in runs) for key in runs[0]})
    if arguments.format == "json":
        print_json(rows)
        return
    print("| steps | nodes | exploring, s | safety, s | progress, s |\n|--:|--:|--:|--:|--:|")
    for row in rows:
        seconds = " | ".join(f"{row[key]:.3f}" for key in ("explored", "safety", "progress"))
        print(f"| {row['steps']} | {row['nodes']} | {seconds} |")


if __name__ == "__main__":
    main()
