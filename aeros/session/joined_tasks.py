"""Tasks of one instruction as one simulator serves them: their scenes, and an initial state for all."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import replace

from aeros.agent.instructions.meaning import Understanding
from aeros.agent.instructions.refusals import InstructionError
from aeros.runtime.gate.configuration import Configuration
from aeros.spec.diagnostics.codes import quoted
from aeros.spec.expr import terms as t
from aeros.spec.model.composition import Composition
from aeros.spec.model.ecm import ActionCondition, Task, owner_of
from aeros.spec.model.step_graph import steps_of


def tasks_of(
    understanding: Understanding,
    configuration: Configuration,
    goal: ActionCondition | None = None,
    composition: Composition | None = None,
) -> list[Task]:
    """List the tasks whose scenes a simulator needs for an instruction.

    Args:
        understanding: The requests, in order.
        configuration: The active modules.
        goal: A goal that replaces that of the only request, as `--goal` gives it; None for none.
        composition: A composition that replaces the rules of the only request; None for none.

    Returns:
        The tasks of the requests, in order, each once; then, for each other module whose variables `goal`
        reads or whose skills `composition` runs, the one of its tasks whose own goal reads most of the
        variables.
    """
    found: list[Task] = []
    for errand in understanding.errands:
        if all(errand.routed.task.span != one.span for one in found):
            found.append(errand.routed.task_at_start)
    read = frozenset() if goal is None else t.variables_of(goal.term).keys()
    others = [name.partition(".")[0] for name in read if "." in name]
    if composition is not None:
        steps = (*steps_of(composition.body), *composition.handlers.values())
        names = (name for step in steps for name in step.runs)
        others += [owner_of(name, understanding.first.module)[0] for name in names]
    served = {
        module
        for errand in understanding.errands
        for module, _ in ((errand.routed.module, None), *errand.routed.task.rehearsals(errand.routed.module))
    }
    return [*found, *_tasks_behind(read, dict.fromkeys(others), served, configuration)]


def request_for_goal(goal: ActionCondition, configuration: Configuration) -> list[str]:
    """Name the task that a goal is of, with the values of its parameters that the goal states.

    Args:
        goal: A goal without an instruction, as `--goal` gives it.
        configuration: The active modules.

    Returns:
        What `--task` takes: of all tasks of modules whose variables the goal reads, the one whose own goal
        reads most of them, the first of these if several do; then `NAME=VALUE` for each `NAME == VALUE` of
        the goal.

    Raises:
        InstructionError: No such module has a task, or the goal reads nothing but values of its parameters,
            so that it holds or fails without any motion.
    """
    read = t.variables_of(goal.term).keys()
    modules = dict.fromkeys(name.partition(".")[0] for name in read)
    found = [
        (one, task) for one in modules for task in _tasks_behind(read, [one], frozenset(), configuration)
    ]
    if not found:
        raise InstructionError(
            f"{quoted(goal.text)} is of no task: give an instruction, or --task NAME, together with --goal"
        )
    module, task = max(found, key=lambda one: _number_read(read, one[1]))
    if read <= {f"{one}.{name}" for one, other in found for name in other.parameters}:
        raise InstructionError(
            f"{quoted(goal.text)} says nothing but values of parameters, which no motion changes: add what "
            f"is to be reached, as in {quoted(f'{task.goal_text} and {goal.text}')}"
        )
    stated = (_stated_value(part.term, module, task) for part in goal.conjuncts)
    return [f"{module}.{task.id}", *(one for one in stated if one)]


def _stated_value(term: t.Term, module: str, task: Task) -> str:
    """Return `NAME=VALUE` if a condition gives a parameter of a task a plain value; empty if it does not."""
    match term:
        case t.Compare("==", t.Variable(name), t.Literal(value)) | t.Compare(
            "==", t.Literal(value), t.Variable(name)
        ) if name.removeprefix(f"{module}.") in task.parameters:
            return f"{name.removeprefix(f'{module}.')}={value}"
    return ""


def joined_task(tasks: Sequence[Task]) -> Task:
    """Return a task whose initial state serves all tasks of an instruction.

    Args:
        tasks: The tasks, as `tasks_of` lists them.

    Returns:
        The first task, with the initial values of the others for variables that it does not name.
    """
    initial = {name: value for task in reversed(tasks) for name, value in task.start.items()}
    return replace(tasks[0], initial=initial)


def _tasks_behind(
    names: AbstractSet[str], modules: Iterable[str], served: AbstractSet[str], configuration: Configuration
) -> Iterator[Task]:
    for module in modules:
        tasks = configuration.modules[module].tasks.values() if module in configuration.modules else ()
        if tasks and module not in served:
            yield max(tasks, key=lambda task: _number_read(names, task))


def _number_read(names: AbstractSet[str], task: Task) -> int:
    return len(names & t.variables_of(task.goal).keys())
