"""Check of a model's answer against the vocabulary and the skills: goals, conditions, prohibitions, plans.

Text of the answer becomes a meaning only if

1.  each task that it names is declared by an active module, and none is both asked for and prohibited;
2.  each goal and condition is a well-typed condition on the present state, can hold, and need not hold;
3.  no goal holds at the declared start of its task, where nothing would be done for it;
4.  each plan passes `verify_plan` and `PlanChecker` from that start, and uses no skill that is prohibited.

A goal that is proved equivalent to that of its task is replaced by the task's own.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

from aeros.agent.errands import barred_skills, barred_steps
from aeros.agent.instructions.meaning import Errand, Understanding
from aeros.agent.instructions.named_task import named_tasks
from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.planning.check_plan import PlanChecker
from aeros.agent.planning.plan_json import MalformedPlanError, plan_from_json
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import TaskGraph, verify_plan
from aeros.agent.reading.agreement import is_equivalent
from aeros.agent.reading.answer import AnsweredRequest, ModelAnswer
from aeros.agent.world.world import WorldModel
from aeros.spec.backends.oracle import Oracle
from aeros.spec.diagnostics.codes import did_you_mean, quoted
from aeros.spec.elaborate.scopes import argument_scope
from aeros.spec.expr import terms as t
from aeros.spec.expr.parser import ExpressionSyntaxError, parse
from aeros.spec.expr.scope import ExpressionTypeError
from aeros.spec.expr.semantics import Environment
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.types import BOOL
from aeros.spec.expr.unparse import unparse
from aeros.spec.model.ecm import Ecm, Task
from aeros.spec.model.site import Site
from aeros.spec.verification.queries import is_unsatisfiable

StartState = Callable[[Task], Environment]
"""Function that returns the exact values at the declared start of a task, by name."""

OTHERWISE: Final = "otherwise"
"""Condition of a request that is done if the one before is not, by the same measurement."""

_NO_PLAN: Final = TaskGraph(())


class UnacceptableAnswerError(Exception):
    """An answer whose parts are not all acceptable.

    Args:
        problems: the reasons, at least one.
    """

    def __init__(self, problems: tuple[str, ...]) -> None:
        super().__init__("; ".join(problems))
        self.problems = problems


class FormalMeaning:
    """Checker of answers against one site and its active modules.

    Args:
        site: site whose vocabulary goals and conditions use.
        modules: active modules by id.
        start: values at the declared start of a task.
        oracle: solver with its budget.
    """

    def __init__(self, site: Site, modules: Mapping[str, Ecm], start: StartState, oracle: Oracle) -> None:
        self._site = site
        self._modules = modules
        self._start = start
        self._oracle = oracle
        self._scope = argument_scope(site)
        self._tasks = {
            f"{name}.{task.id}": RoutedTask(name, task)
            for name, module in modules.items()
            for task in module.tasks.values()
        }

    def meaning_of(self, instruction: str, answer: ModelAnswer) -> Understanding:
        """Check an answer and return its meaning.

        Args:
            instruction: words of the user.
            answer: answer of a model.

        Returns:
            The meaning; each errand has its plan.

        Raises:
            UnacceptableAnswerError: a part of the answer is not acceptable.
        """
        if not answer.requests:
            raise UnacceptableAnswerError(("it reads no request in the instruction",))
        problems: list[str] = []
        errands: list[Errand | None] = []
        for number, request in enumerate(answer.requests, 1):
            errands.append(self._errand(request, f"request {number}", problems, errands))
        named = (
            self._task(name, f"prohibition {number}", problems)
            for number, name in enumerate(answer.prohibited, 1)
        )
        prohibited = tuple({str(routed): routed for routed in named if routed is not None}.values())
        found = tuple(errand for errand in errands if errand is not None)
        meaning = Understanding(instruction, found, prohibited)
        problems += [
            f"`{errand.routed}` is asked for and prohibited"
            for errand in found
            if any(one.covers(errand.routed) for one in prohibited)
        ]
        if not problems:
            problems += self._plan_problems(meaning)
        if problems:
            raise UnacceptableAnswerError(tuple(problems))
        return meaning

    def _task(self, name: str, part: str, problems: list[str]) -> RoutedTask | None:
        routed = self._tasks.get(name)
        if routed is None:
            near = did_you_mean(name, self._tasks)
            hint = f"; did you mean `{near}`?" if near else ""
            problems.append(f"{part}: no active module has the task {quoted(name)}{hint}")
        return routed

    def _errand(
        self, request: AnsweredRequest, part: str, problems: list[str], before: Sequence[Errand | None]
    ) -> Errand | None:
        routed = self._task(request.task, part, problems)
        if routed is not None:
            routed = self._with_arguments(routed, request, part, problems)
        goal = self._condition(request.goal, f"the goal of {part}", problems)
        is_otherwise = request.condition == OTHERWISE
        condition = (
            None
            if request.condition is None or is_otherwise
            else self._condition(request.condition, f"the condition of {part}", problems)
        )
        plan = self._plan(request.plan, part, problems)
        if routed is None or goal is None:
            return None
        task = routed.task
        if not is_equivalent(goal, task.goal, self._site, self._oracle):
            task = replace(task, goal=goal, goal_text=unparse(goal), goal_conjuncts=(), rules=())
        routed = replace(routed, task=task)
        if WorldModel(0.0, self._start(routed.task_at_start), {}, {}).evaluate(goal) is True:
            problems.append(f"the goal of {part} holds already at the declared start of `{routed}`")
        if is_otherwise:
            first = before[-1] if before else None
            if first is None or first.condition is None or first.is_otherwise:
                problems.append(f"{part} has no request with a condition of its own before it")
                return None
            return replace(first.otherwise(routed), proposed_plan=plan)
        text = "" if condition is None else unparse(condition)
        return Errand(routed, condition, text, plan)

    def _with_arguments(
        self, routed: RoutedTask, request: AnsweredRequest, part: str, problems: list[str]
    ) -> RoutedTask | None:
        """Return the task with its arguments; None after adding the problem."""
        given = " ".join(shlex.quote(f"{name}={value}") for name, value in request.arguments)
        try:
            (found,) = named_tasks(f"{routed} {given}", [routed])
        except (InstructionError, ValueError) as error:
            problems.append(f"{part}: its arguments are not those of `{routed}`: {error}")
            return None
        return found

    def _condition(self, text: str, place: str, problems: list[str]) -> t.Term | None:
        """Elaborate a condition that can hold and need not hold; None after adding the problem."""
        try:
            term = check(parse(text), self._scope, BOOL)
        except (ExpressionSyntaxError, ExpressionTypeError) as fault:
            problems.append(f"{place} is not a condition: {fault.message}")
            return None
        if any(isinstance(one, t.PastTerm) for one in _walk(term)):
            problems.append(f"{place} is about the past")
            return None
        declared = tuple(self._site.state.values())
        for sense, constant in ((term, "never holds"), (t.Not(term), "always holds")):
            if is_unsatisfiable((sense,), declared, self._oracle):
                problems.append(f"{place} {constant}: {quoted(text)}")
                return None
        return term

    def _plan(self, data: Any, part: str, problems: list[str]) -> TaskGraph:
        try:
            return plan_from_json(data, self._site)
        except MalformedPlanError as error:
            problems.append(f"{part}: {error}")
            return _NO_PLAN

    def _plan_problems(self, meaning: Understanding) -> Iterator[str]:
        for number, errand in enumerate(meaning.errands, 1):
            graph = errand.proposed_plan or _NO_PLAN
            world = WorldModel(0.0, self._start(errand.routed.task_at_start), {}, {})
            barred = barred_skills(meaning, errand, self._modules)
            problems = (
                verify_plan(graph, self._modules, self._site)
                or barred_steps(graph, barred, self._modules)
                or PlanChecker(errand.routed, world, self._modules, self._site, self._oracle).problems(graph)
            )
            yield from (f"the plan of request {number}: {one}" for one in problems)


def _walk(term: t.Term) -> Iterator[t.Term]:
    yield term
    for child in t.children(term):
        yield from _walk(child)
