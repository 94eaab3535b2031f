"""`aeros plan`: find the shortest plan from which the goal always stays reachable, or check a given plan."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from aeros.agent.instructions.meaning import single_errand
from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.understand import understand
from aeros.agent.planning.plan_json import plan_to_json
from aeros.agent.planning.strategy_to_graph import strategy_to_graph
from aeros.agent.planning.strong_cyclic import explain_no_plan
from aeros.agent.planning.task_graph import verify_plan
from aeros.agent.world.values import to_exact, to_json_value
from aeros.apps.goal import parse_goal, parse_value
from aeros.cli.arguments import add_command, add_module_folders, existing_path, print_warning
from aeros.cli.module_settings import add_module_settings, module_configurations
from aeros.cli.terminal.rendering import number_text, table_lines
from aeros.cli.terminal.streams import print_data, print_line
from aeros.exit_codes import Exit, UsageError
from aeros.files import make_folder
from aeros.runtime.registry.folder_modules import FolderModules, default_modules, uses_installed_modules
from aeros.runtime.registry.registry import Registry
from aeros.session.setup import declared_start
from aeros.spec.closed_loop.invocation import State
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.diagnostics.grammar import counted
from aeros.spec.diagnostics.render import escape_invisible
from aeros.spec.expr.semantics import Value
from aeros.spec.model.ecm import ActionCondition, Ecm, Task, owner_of
from aeros.spec.model.site import Site
from aeros.spec.planning.domain import PlanningDomain, domain_for
from aeros.spec.planning.pddl import write_pddl
from aeros.spec.planning.plan_check import UnreadablePlanError, find_step_problems, read_plan
from aeros.spec.planning.quickest import estimate_strategy, quickest_strategy
from aeros.spec.planning.search_result import PlanUndecidedError
from aeros.spec.planning.strong_cyclic import StrongCyclicStrategy
from aeros.spec.text.files import read_source

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

SCHEMA = "aeros/plan/1"
CHECK_SCHEMA = "aeros/plan-check/1"

_EXAMPLES = """\
The search uses preconditions and outcomes of the skills of all modules, not planning rules, as
`aeros run --planner smt` does.  As long as only declared outcomes occur, the plan never leads to a state
from which the goal cannot be reached; it is the shortest such plan.  It starts from the same state as the
symbolic plant: the task's `initial`, or harmless values if no instruction is given.

examples:
  aeros plan "make dumplings"
  aeros plan "make dumplings" --initial dough_on_workspace=true --initial filling_on_workspace=true
  aeros plan "clean the table" --initial wiping_area_clear=unknown
  aeros plan --goal "object_grasped and not object_delivered" --format json
  aeros plan "make dumplings" --export-pddl pddl/
  aeros plan check dumplings.plan "make dumplings"       accept a given plan, or list its problems

A given plan has the format of classical planners: one `(module.skill)`, `(module.capability)` or PDDL action
on each line.
"""


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "plan", __doc__, _EXAMPLES)
    parser.usage = "aeros plan [INSTRUCTION] [options]\n       aeros plan check FILE [INSTRUCTION] [options]"
    parser.add_argument(
        "words",
        nargs="*",
        metavar="INSTRUCTION",
        help='the task to plan, as in "make dumplings"; after `check FILE`, the task of that plan',
    )
    parser.add_argument("--goal", metavar="EXPR", help="goal condition that replaces the task's goal")
    parser.add_argument(
        "--initial",
        type=_setting,
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="initial value of a state variable, or `unknown` (repeatable)",
    )
    add_module_folders(parser, "the modules (default: as for `aeros run`)")
    add_module_settings(parser)
    parser.add_argument("--site", type=existing_path, help="the site file (default: as for `aeros run`)")
    parser.add_argument(
        "--state", type=Path, default=Path(".aeros"), help="the agent's own folder (default: .aeros)"
    )
    parser.add_argument(
        "--export-pddl",
        type=Path,
        metavar="FOLDER",
        help="write domain.pddl and problem.pddl for a classical planner instead of planning",
    )
    parser.add_argument(
        "--every-step",
        action="store_true",
        help="of `check FILE`: check the steps after the goal is reached, too, as other executors run them",
    )
    parser.add_argument("--format", choices=("text", "json"), default="text", help="default: text")
    parser.set_defaults(command=_command)


def _setting(text: str) -> tuple[str, str]:
    name, sign, value = text.partition("=")
    if not sign or not name.strip() or not value.strip():
        raise argparse.ArgumentTypeError("expected NAME=VALUE, as in `door_open=true`")
    return name.strip(), value.strip()


def _parse_words(words: list[str]) -> tuple[Path | None, str | None]:
    """Split the arguments into the plan to check, if any, and the instruction, if any.

    Raises:
        UsageError: There are several instructions, or the plan cannot be read.
    """
    check = None
    if words[:1] == ["check"] and len(words) > 1:
        try:
            check = existing_path(words[1])
        except argparse.ArgumentTypeError as error:
            raise UsageError(f"the plan to check: {error}") from error
        words = words[2:]
    if len(words) > 1:
        raise UsageError(f'an instruction is one argument: "{escape_invisible(" ".join(words))}"')
    return check, words[0] if words else None


def _command(arguments: argparse.Namespace) -> Exit:
    check, instruction = _parse_words(arguments.words)
    if instruction is None and arguments.goal is None:
        raise UsageError("give an instruction or --goal")
    if check is not None and arguments.export_pddl is not None:
        raise UsageError("`check` cannot be combined with --export-pddl")
    if check is None and arguments.every_step:
        raise UsageError("--every-step requires `check FILE`")
    site, modules, others = _load(arguments)
    task: Task | None = None
    if instruction is not None:
        try:
            task = single_errand(understand(instruction, modules, others)).task_at_start
        except InstructionError as refusal:
            print(f"aeros: {refusal}", file=sys.stderr)
            return Exit.REJECTED
    goal = parse_goal(arguments.goal, site) if arguments.goal is not None else _task_goal(task)
    known = _start(site, task, dict(arguments.initial), modules.values())
    steps = None if check is None else _steps(check)
    providers = capability_providers(modules)
    also = {
        name.casefold()
        for step in steps or ()
        for name in providers.get(step.casefold(), (step.partition(" ")[0],))
    }
    kept = () if task is None else task.invariants
    domain = domain_for(modules, site, known, goal.term, kept, extra_variables=also)
    start = domain.state(known)
    if arguments.export_pddl is not None:
        return _export_pddl(arguments.export_pddl, domain, start)
    if steps is not None:
        strategy = StrongCyclicStrategy(domain)
        try:
            problems = find_step_problems(strategy, start, steps, providers, every_step=arguments.every_step)
        except PlanUndecidedError as why:
            print(f"aeros: undecided: {why}", file=sys.stderr)
            return Exit.UNDECIDED
        return _check_result(steps, problems, arguments.format)
    found: dict[str, Any] = {
        "schema": SCHEMA,
        "goal": goal.text,
        "start": {name: to_json_value(value) for name, value in zip(domain.names, start, strict=True)},
        "plan": None,
        "steps_at_least": None,
        "states": None,
        "expected_s": None,
        "risk": None,
        "reason": None,
        "left_out": dict(domain.excluded_skills),
    }
    code = Exit.SUCCESS
    try:
        strategy = quickest_strategy(domain, start, site.limits.retries)
        if strategy.solves(start):
            graph = strategy_to_graph(strategy, start, site.limits.retries)
            if graph.parts and (problems := verify_plan(graph, modules, site)):
                raise InternalError("; ".join(problems))
            found["plan"] = plan_to_json(graph)
            found["steps_at_least"] = strategy.distance_to_goal(start)
            found["states"] = len(strategy.reachable_from(start))
            estimate = estimate_strategy(strategy, start, site.limits.retries)
            found["expected_s"], found["risk"] = estimate.seconds, estimate.risk
        else:
            code, found["reason"] = Exit.REJECTED, explain_no_plan(strategy)
    except PlanUndecidedError as why:
        code, found["reason"] = Exit.UNDECIDED, str(why)
    if arguments.format == "json":
        print_data(json.dumps(found, indent=1))
    else:
        print(_as_text(found))
    return code


def _steps(path: Path) -> tuple[str, ...]:
    try:
        return read_plan(read_source(path).text)
    except UnreadablePlanError as why:
        raise UsageError(f"`{path}` is not a plan: {why}") from why


def _export_pddl(folder: Path, domain: PlanningDomain, start: State) -> Exit:
    files = dict(zip(("domain.pddl", "problem.pddl"), write_pddl(domain, start), strict=True))
    try:
        make_folder(folder)
        for name, text in files.items():
            (folder / name).write_text(text, encoding="utf-8")
    except OSError as error:
        print(f"aeros: cannot write to `{folder}`: {error.strerror}", file=sys.stderr)
        return Exit.REJECTED
    print_line(f"written  {', '.join(str(folder / name) for name in files)}")
    return Exit.SUCCESS


def capability_providers(modules: Mapping[str, Ecm]) -> dict[str, tuple[str, ...]]:
    """Collect the skills that provide each capability.

    Args:
        modules: active modules by id.

    Returns:
        Names MODULE.SKILL by MODULE.CAPABILITY, case-folded, for capabilities that skills alone provide.
    """
    return {
        f"{module}.{name}".casefold(): tuple(".".join(owner_of(one, module)) for one in ecm.providers(name))
        for module, ecm in modules.items()
        for name in ecm.capabilities
        if name not in ecm.skills and ecm.providers(name)
    }


def _check_result(steps: tuple[str, ...], problems: list[str], form: str) -> Exit:
    if form == "json":
        found = {"schema": CHECK_SCHEMA, "steps": steps, "accepted": not problems, "problems": problems}
        print_data(json.dumps(found, indent=1))
    else:
        accepted = (
            f"accepted  {counted(len(steps), 'step')}; the goal stays reachable after every declared outcome"
        )
        print("\n".join([f"rejected  {escape_invisible(text)}" for text in problems] or [accepted]))
    return Exit.REJECTED if problems else Exit.SUCCESS


def _load(
    arguments: argparse.Namespace,
) -> tuple[Site, Mapping[str, Ecm], Callable[[], Mapping[str, Ecm]]]:
    """Load the site, the modules to plan with, and the inactive modules.

    Without options the robot's registry is used if there is one; files named by options are read, not proved.
    The operator's word holds for both: blocked and withdrawn modules and skills are not planned with.

    Raises:
        UserError: A file is rejected, or `--site` is not the policy that the operator set.
    """
    registry = Registry(arguments.state)
    if arguments.ecms is None and arguments.site is None and uses_installed_modules(registry):
        configuration, _ = registry.configuration()
        return configuration.site, configuration.modules, registry.inactive_modules
    snapshot = registry.snapshot()
    configurations = module_configurations(arguments)
    source = FolderModules(
        arguments.ecms or default_modules(), arguments.site, registry, configurations=configurations
    )
    site, modules, withheld = source.load_unproved(snapshot)
    for reason in withheld.values():
        print_warning(f"{reason} on this robot, so it is not planned with")
    return site, modules, dict[str, Ecm]


def _task_goal(task: Task | None) -> ActionCondition:
    if task is None:
        raise InternalError("there is neither a task nor a goal")
    return ActionCondition(task.goal, task.goal_text, task.span)


def _start(
    site: Site, task: Task | None, given: Mapping[str, str], modules: Iterable[Ecm]
) -> dict[str, Value]:
    """Return the known values at the start, by name."""
    known = declared_start(site, task, modules)
    for name, text in given.items():
        full, value = parse_value(name, text, site)
        if value is None:
            known.pop(full, None)
        else:
            known[full] = to_exact(site.state[full], value)
    return known


def _as_text(found: Mapping[str, Any]) -> str:
    start = ", ".join(f"{name} = {_format_value(value)}" for name, value in found["start"].items())
    rows = [("goal", found["goal"]), ("start", start or "as measured")]
    if found["reason"] is not None:
        rows.append(("none", found["reason"]))
    elif not found["plan"]:
        rows.append(("plan", "nothing to do: the goal holds"))
    lines = table_lines(rows, width=None)
    if found["reason"] is None and found["plan"]:
        lines += ["plan", *_format_parts(found["plan"], "  ")]
        lines.append(
            f"proved the goal can be reached from each of the {found['states']} states that declared "
            f"outcomes may lead to; the path has {found['steps_at_least']} step"
            + ("" if found["steps_at_least"] == 1 else "s")
        )
        lines.append(
            f"time   {found['expected_s']:.0f} s are expected, a failure counting as a minute; "
            f"the risk that a step fails in all its tries is {found['risk']:.2g}"
        )
    return "\n".join(map(escape_invisible, lines))


def _format_parts(parts: list[dict[str, Any]], margin: str) -> Iterator[str]:
    for part in parts:
        if "if" in part:
            yield f"{margin}if {part['if']}"
            yield from _format_parts(part["then"], f"{margin}  ")
            if part["else"]:
                yield f"{margin}else"
                yield from _format_parts(part["else"], f"{margin}  ")
            continue
        given = ", ".join(f"{name} = {_format_value(value)}" for name, value in part["inputs"].items())
        tried = f", tried {part['retry'] + 1} times at most" if part["retry"] else ""
        cure = f", {part['between_tries']} between tries" if part["between_tries"] else ""
        cure += f", {part['on_failure']} after the last" if part["on_failure"] else ""
        yield f"{margin}{part['skill']}" + (f"({given})" if given else "") + tried + cure


def _format_value(value: Any) -> str:
    if isinstance(value, float):
        return number_text(value)
    return "unknown" if value is None else json.dumps(value)
