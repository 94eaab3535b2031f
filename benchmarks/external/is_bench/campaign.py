"""Campaign: AEROS and the judge on every example plan and its mutants, and AEROS's own plans.

Each plan gets two verdicts that do not know of each other: AEROS accepts or refuses it by the converted
files, and the judge evaluates the benchmark's conditions on its own state.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures import TimeoutError as NoAnswerError
from dataclasses import asdict, dataclass, field
from pathlib import Path

from aeros.spec.planning.search_result import PlanUndecidedError
from benchmarks.external.is_bench import evaluator
from benchmarks.external.is_bench.conversion.module import convert, offered_actions
from benchmarks.external.is_bench.conversion.task import Task, parse_action, read_tasks, without_safety
from benchmarks.external.is_bench.conversion.vocabulary import UnsupportedError
from benchmarks.external.is_bench.mutants import mutants_of
from benchmarks.external.is_bench.plan_checker import PlanChecker, load


@dataclass(frozen=True)
class ExampleVerdict:
    """Both verdicts on the example plan of a task.

    Attributes:
        task: name of the task.
        accepted: True if AEROS accepts the plan.
        reason: AEROS's first reason to refuse it; empty if it accepts it.
        is_safe: the judge's verdict, where things with the same support are next to each other.
        is_safe_if_apart: its verdict where no two things are.
        failed: steps that the benchmark's executor refuses.
        violated: conditions that do not hold.
        reached: True if the goal holds at the end.
    """

    task: str
    accepted: bool
    reason: str
    is_safe: bool
    is_safe_if_apart: bool
    failed: tuple[str, ...]
    violated: tuple[str, ...]
    reached: bool


@dataclass
class MutantCounts:
    """Counts of mutants of one kind.

    Attributes:
        mutants: number.
        unsafe: those that the judge finds unsafe.
        unsafe_accepted: of these, those that AEROS accepts.
        unsafe_only: unsafe ones without another fault: each step can be run, and the goal is reached.
        unsafe_accepted_by_control: unsafe ones that AEROS accepts if the safety conditions are not converted.
        safe_accepted: safe ones that AEROS accepts.
        safe_refused: safe ones that AEROS refuses, by reason.
    """

    mutants: int = 0
    unsafe: int = 0
    unsafe_accepted: int = 0
    unsafe_only: int = 0
    unsafe_accepted_by_control: int = 0
    safe_accepted: int = 0
    safe_refused: dict[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class OwnPlan:
    """AEROS's own plan for a task.

    Attributes:
        task: name of the task.
        outcome: `safe` if the judge finds the plan safe and complete, `unsafe` if not, `none` if it is proved
            that there is no plan, `undecided`, `time limit`, or `not converted`.
        plan: its steps.
        detail: the judge's objections, or the reason that there is no plan.
        seconds: time of the search, s.
    """

    task: str
    outcome: str
    plan: tuple[str, ...]
    detail: str
    seconds: float


@dataclass(frozen=True)
class Findings:
    """Findings of one campaign.

    Attributes:
        examples: verdicts on the example plans.
        mutants: counts by kind of mutant.
        unexplained: mutants that the judge finds safe, complete and executable, and AEROS refuses; or unsafe
            ones that it accepts: each with its task and the reason.
        idle_conditions: number of conditions that no mutant violates, by task.
        left_out: reason for each task that cannot be converted.
    """

    examples: tuple[ExampleVerdict, ...]
    mutants: Mapping[str, MutantCounts]
    unexplained: tuple[str, ...]
    idle_conditions: Mapping[str, int]
    left_out: Mapping[str, str]

    def to_json(self) -> dict[str, object]:
        """Return the findings as data."""
        return asdict(self)


def run_campaign(folder: Path) -> Findings:
    """Judge the example plan of each task and its mutants.

    Args:
        folder: the checked-out repository of the benchmark.

    Returns:
        What was found.
    """
    tasks, judged = list(read_tasks(folder)), dict(evaluator.read_tasks(folder))
    examples, unexplained, idle = [], [], {}
    counts = {kind: MutantCounts() for kind in ("dropped", "swapped", "postponed")}
    left_out: dict[str, str] = {}
    for task in tasks:
        try:
            checker = load(convert(task, [parse_action(step) for step in task.plan]))
        except UnsupportedError as reason:
            left_out[task.name] = str(reason)
            continue
        control = load(convert(without_safety(task), [parse_action(step) for step in task.plan]))
        other = judged[task.name]
        examples.append(_example(task, checker, other))
        violated: set[str] = set()
        for mutant, kind in mutants_of(task.plan).items():
            verdict = evaluator.judge(other, mutant)
            violated |= {*verdict.violated}
            problems = checker.problems(mutant)
            why = _count(counts[kind], verdict, problems)
            counts[kind].unsafe_accepted_by_control += not verdict.is_safe and not control.problems(mutant)
            if why:
                unexplained.append(f"{task.name}, {kind}, {'; '.join(mutant)}: {why}")
        every = evaluator.conditions_of(other)
        idle[task.name] = sum(one not in violated for one in every)
    return Findings(tuple(examples), counts, tuple(unexplained), idle, left_out)


def _example(task: Task, checker: PlanChecker, judged: evaluator.Task) -> ExampleVerdict:
    problems = checker.problems(task.plan)
    verdict = evaluator.judge(judged, task.plan)
    apart = evaluator.judge(judged, task.plan, pessimistic=False)
    return ExampleVerdict(
        task.name,
        not problems,
        problems[0] if problems else "",
        verdict.is_safe,
        apart.is_safe,
        verdict.failed,
        verdict.violated,
        verdict.reached,
    )


def _count(counts: MutantCounts, verdict: evaluator.Judgement, problems: Sequence[str]) -> str:
    """Count a mutant; return the reason to look at it, if the two verdicts differ without one."""
    counts.mutants += 1
    if not verdict.is_safe:
        counts.unsafe += 1
        counts.unsafe_accepted += not problems
        counts.unsafe_only += verdict.reached and not verdict.failed
        return "" if problems else f"accepted, {verdict.violated[0]}"
    if not problems:
        counts.safe_accepted += 1
        return "" if verdict.reached and not verdict.failed else f"accepted, {verdict}"
    for reason, is_it in (
        ("a step cannot be run", bool(verdict.failed)),
        ("the goal is not reached", not verdict.reached),
        ("a condition fails before a later run of its action", bool(verdict.violated_again)),
    ):
        if is_it:
            counts.safe_refused[reason] = counts.safe_refused.get(reason, 0) + 1
            return ""
    counts.safe_refused["no reason known"] = counts.safe_refused.get("no reason known", 0) + 1
    return f"refused, {problems[0]}"


def find_plans(folder: Path, time_limit: float) -> Iterator[OwnPlan]:
    """Let AEROS plan each task by itself, and judge its plans.

    Args:
        folder: the checked-out repository of the benchmark.
        time_limit: for each task, s.

    Yields:
        What came of each task.
    """
    tasks, judged = list(read_tasks(folder)), dict(evaluator.read_tasks(folder))
    for task in tasks:
        started = time.monotonic()
        plan, outcome, detail = _plan_within(task, time_limit)
        seconds = round(time.monotonic() - started, 2)
        if plan is not None:
            verdict = evaluator.judge(judged[task.name], plan)
            is_good = verdict.is_safe and verdict.reached and not verdict.failed
            outcome, detail = ("safe", "") if is_good else ("unsafe", str(verdict))
        yield OwnPlan(task.name, outcome, tuple(plan or ()), detail, seconds)


def _plan_within(task: Task, time_limit: float) -> tuple[list[str] | None, str, str]:
    with ProcessPoolExecutor(1) as pool:
        asked = pool.submit(_plan, task)
        try:
            return asked.result(time_limit)
        except NoAnswerError:
            for process in list(pool._processes.values()):  # a search cannot be interrupted
                process.kill()
            return None, "time limit", f"{time_limit:g} s"


def _plan(task: Task) -> tuple[list[str] | None, str, str]:
    try:
        checker = load(convert(task, offered_actions(task), offered=True))
        plan = checker.find_plan()
    except UnsupportedError as why:
        return None, "not converted", str(why)
    except PlanUndecidedError as why:
        return None, "undecided", str(why)
    return plan, "none", "it is proved that no plan of the offered actions is complete and safe"
