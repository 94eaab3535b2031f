"""Diagrams of a run: its latest plan, and the transitions between skills with counts."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from itertools import islice, pairwise
from textwrap import wrap
from typing import Final

from aeros.apps.drawings.drawing import Diagram, Edge, Node, Shape
from aeros.apps.report_page.run_data import RunData, SkillExecution, plan_step_states, shortened

_MAX_SKILLS = 60
_MAX_TEXT_CHARS = 60


def plan_diagram(left: RunData) -> Diagram | None:
    """Draw the latest plan and the final state of each part.

    Args:
        left: Data of the run.

    Returns:
        The diagram; None if the run had no plan.
    """
    plan = next((event for event in reversed(left.events) if event.kind == "plan-accepted"), None)
    if plan is None:
        return None
    since = [run for run in left.runs if run.start_time >= plan.time]
    parts = [
        Node(f"p{number}", (*_wrapped(text), _FINAL_STATE_TEXT.get(how, how)), _SHAPES[how])
        for number, (text, how) in enumerate(islice(plan_step_states(plan, since), _MAX_SKILLS), 1)
    ]
    nodes = (Node("p0", (f"planned at {plan.time:.2f} s",), "start"), *parts)
    return Diagram("the latest plan", nodes, tuple(Edge(one.id, other.id) for one, other in pairwise(nodes)))


_SHAPES: Final[dict[str, Shape]] = {
    "done": "goal",
    "failed": "stuck",
    "under way": "choice",
    "to come": "step",
}


_FINAL_STATE_TEXT: Final = {"to come": "not run", "under way": "not ended"}
"""Texts of unfinished states, for a run that is over."""


def _wrapped(text: str) -> list[str]:
    return wrap(shortened(text, 8 * _MAX_TEXT_CHARS), _MAX_TEXT_CHARS) or [""]


def run_diagram(left: RunData) -> Diagram:
    """Draw each skill once, with counted transitions, so that a long run needs no more room than a short one.

    Args:
        left: Data of the run.

    Returns:
        The diagram.
    """
    tries: defaultdict[str, list[SkillExecution]] = defaultdict(list)
    for run in left.runs:
        tries[run.skill].append(run)
    skills = list(tries)[:_MAX_SKILLS]
    ids = {skill: f"n{number}" for number, skill in enumerate(skills, 1)}
    counts: Counter[tuple[str, str, str, bool]] = Counter()
    for run in left.runs:
        before = run.previous
        source = "n0" if before is None else ids.get(before.skill)
        if source is not None and run.skill in ids:
            how = "" if before is None else shortened(before.result_text, _MAX_TEXT_CHARS)
            counts[source, ids[run.skill], how, before is not None and before.failed is True] += 1
    last = max(left.runs, key=lambda run: run.end_time or run.start_time, default=None)
    ended, shape = _end(left)
    counts[
        "n0" if last is None else ids.get(last.skill, "n0"), "end", _outcome_text(last), _failed(last)
    ] += 1
    nodes = [Node("n0", (shortened(_instruction(left), _MAX_TEXT_CHARS),), "start")]
    nodes += [Node(ids[skill], tuple(_skill_text(skill, tries[skill]))) for skill in skills]
    return Diagram(
        "skill sequence",
        (*nodes, Node("end", (ended,), shape)),
        tuple(
            Edge(source, target, f"{how} ×{count}" if how and count > 1 else how, failed)
            for (source, target, how, failed), count in counts.items()
        ),
    )


def _skill_text(skill: str, tries: Sequence[SkillExecution]) -> list[str]:
    failed = sum(_failed(run) for run in tries)
    times = "once" if len(tries) == 1 else f"{len(tries)} times"
    return [shortened(skill, _MAX_TEXT_CHARS), times + (f", {failed} failed" if failed else "")]


def _outcome_text(run: SkillExecution | None) -> str:
    return "" if run is None else shortened(run.result_text, _MAX_TEXT_CHARS)


def _failed(run: SkillExecution | None) -> bool:
    return run is not None and run.failed is True


def _instruction(left: RunData) -> str:
    return next((str(one.get("instruction")) for kind, one in left.notes if kind == "task-selected"), "began")


def _end(left: RunData) -> tuple[str, Shape]:
    for kind, details in reversed(left.notes):
        if kind == "run-ended":
            if details.get("skipped") is True:
                return "skipped", "goal"
            return ("goal reached", "goal") if details.get("reached") is True else ("not reached", "stuck")
    return "no end is recorded", "stuck"
