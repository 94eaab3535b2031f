"""`aeros predict`: compute a task's success probability and expected work exactly, from its manifest."""

from __future__ import annotations

import argparse
import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import asdict, replace
from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal, localcontext
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from aeros.agent.agent import MEMORY_FILE
from aeros.agent.errors import AgentError
from aeros.agent.memory.experience import experienced_beliefs, with_experience
from aeros.agent.memory.queries import open_memory_reader
from aeros.cli.arguments import add_command, existing_path
from aeros.cli.author.module_argument import add_module, read_module, select_declared
from aeros.cli.module_settings import add_module_settings, module_configurations
from aeros.cli.plant_argument import plant_name
from aeros.cli.terminal.rendering import number_text, print_table
from aeros.cli.terminal.streams import print_data, print_line
from aeros.exit_codes import Exit, UsageError
from aeros.sim.symbolic.state import initial_values
from aeros.spec.closed_loop.giving_up import AgentBeliefs, declared_beliefs
from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.closed_loop.markov_chain import InexactError, predict
from aeros.spec.closed_loop.outcome_probabilities import with_retries, with_skill_probabilities
from aeros.spec.closed_loop.success_bounds import bound_success
from aeros.spec.closed_loop.transition_system import TransitionSystem
from aeros.spec.consequences.consequences import known_definitions
from aeros.spec.consequences.start_values import with_defined_predicates
from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel
from aeros.spec.diagnostics.errors import MisuseError, UserError
from aeros.spec.diagnostics.render import escape_invisible
from aeros.spec.expr.doubles import to_doubles
from aeros.spec.model.ecm import Ecm, Task
from aeros.spec.model.site import Site

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

SCHEMA = "aeros/prediction/1"

_LONGEST_FRACTION: Final = 60
"""Longest fraction that is printed beside its decimal; `--format json` has all, characters."""

_LABELS = {
    "success_at_least": "success, at least",
    "success_at_most": "success, at most",
    "success": "success probability",
    "failure": "failure probability",
    "invocations": "expected invocations",
    "retries": "  of these, retries",
    "recoveries": "  of these, recoveries",
    "replans": "expected re-plans",
    "seconds": "expected time, s",
}

_EXAMPLES = """\
The agent's loop with its retries, recoveries and re-plans is a Markov chain over the declared outcomes.
It is solved exactly, in fractions, without sampling.  Where parallel branches may fail, or an outcome leaves
a predicate at either value, only the success is bounded.  A run starts from the same state as the symbolic
plant: the task's `initial`, everything else false.  With --probability the other outcomes of the skill keep
their proportions.  With --from-memory, probabilities and durations are what the agent experienced with this
code on that plant, four results of each skill being as declared.  An outcome whose duration is not known
counts as 10 s.  Where a composition may run, there is no expected time: branches may overlap.  The module is
not proved; use `aeros verify`.

The agent gives up failures in one state that chance does not explain, and so does the prediction.  Chance is
what the module declares, or with --from-memory what was experienced, whatever --probability says.  So a
skill that declares 10 % of failures and fails in 90 % is given up at its eighth failure in a row.

examples:
  aeros predict ecms/make_dumplings                                as declared, with the site's re-plans
  aeros predict ecms/make_dumplings --probability wrap.wrapped=70%   wrapping fails in 30 % of all tries
  aeros predict ecms/clean_table --probability wipe.streaky=0.4 --max-retries wipe=3 --max-replans 0
  aeros predict ecms/fetch_object --probability grasp.grasped=13/20 --format json
  aeros predict ecms/fetch_object --from-memory .aeros --plant physics
  aeros predict my/tidy_shelf --ecms ecms                            it requires modules of another folder
"""


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "predict", __doc__, _EXAMPLES)
    add_module(parser)
    parser.add_argument("--task", help="one of its tasks (default: all)")
    parser.add_argument(
        "--probability",
        type=_probability,
        action="append",
        default=[],
        metavar="SKILL.OUTCOME=P",
        help="override an outcome probability, as 0.7, 7/10 or 70%% (repeatable)",
    )
    parser.add_argument(
        "--from-memory",
        type=existing_path,
        metavar="FOLDER",
        help="use the outcomes that the agent with this state folder has seen",
    )
    parser.add_argument(
        "--plant",
        type=plant_name,
        default="physics",
        metavar="NAME",
        help="plant of these outcomes (default: physics)",
    )
    parser.add_argument(
        "--max-replans", type=_count, metavar="N", help="maximum number of re-plans (default: the site's)"
    )
    parser.add_argument(
        "--max-retries",
        type=_retry,
        action="append",
        default=[],
        metavar="SKILL=N",
        help="override the number of retries of steps with this skill (repeatable)",
    )
    add_module_settings(parser)
    parser.add_argument(
        "--site", type=existing_path, help="the site file (default: the reference site, a Panda cell)"
    )
    parser.add_argument("--format", choices=("text", "json"), default="text", help="default: text")
    parser.set_defaults(command=_command)


def _probability(text: str) -> tuple[str, str, Fraction]:
    form = r"(\w+)\.(\w+)=(\d{1,9}(?:\.\d{1,9})?)(?:/(0*[1-9]\d{0,8})|(%))?"
    found = re.fullmatch(form, text, re.ASCII)
    if found is None:
        raise argparse.ArgumentTypeError(
            "expected SKILL.OUTCOME=P, as in `wrap.wrapped=0.7`, `7/10` or `70%`"
        )
    value = Fraction(found[3]) / (100 if found[5] else int(found[4] or 1))
    if value > 1:
        raise argparse.ArgumentTypeError(f"`{text}`: a probability is at most 1")
    return found[1], found[2], value


def _retry(text: str) -> tuple[str, int]:
    skill, _, number = text.partition("=")
    if not skill or not _is_count(number):
        raise argparse.ArgumentTypeError("expected SKILL=N, as in `wrap=3`")
    return skill, int(number)


def _count(text: str) -> int:
    if not _is_count(text):
        raise argparse.ArgumentTypeError("expected a whole number from 0 to 9999")
    return int(text)


def _is_count(text: str) -> bool:
    return re.fullmatch(r"\d{1,4}", text, re.ASCII) is not None


def _command(arguments: argparse.Namespace) -> Exit:
    found, site = read_module(
        arguments.module, arguments.ecms or (), arguments.site, module_configurations(arguments)
    )
    chosen = (
        found.tasks.values()
        if arguments.task is None
        else [select_declared(found, "task", found.tasks, arguments.task)]
    )
    for skill, retries in arguments.max_retries:
        if retries > site.limits.retries:
            raise UsageError(
                f"`--max-retries {skill}={retries}`: {site.id} allows at most {site.limits.retries}"
            )
    beliefs = declared_beliefs(found)
    if arguments.from_memory is not None:
        found, beliefs = _experienced(found, arguments.from_memory, arguments.plant)
    try:
        ecm, tasks = _apply_overrides(found, chosen, arguments)
    except MisuseError as error:
        raise UsageError(str(error)) from error
    replans = site.limits.replans if arguments.max_replans is None else arguments.max_replans
    predictions = [_prediction_json(ecm, task, site, replans, beliefs) for task in tasks]
    if arguments.format == "json":
        print_data(json.dumps({"schema": SCHEMA, "predictions": predictions}, indent=1))
    else:
        for place, one in enumerate(predictions):
            _print_text(one, is_first=not place)
    return Exit.SUCCESS


def _experienced(ecm: Ecm, folder: Path, plant: str) -> tuple[Ecm, AgentBeliefs]:
    """Give the module the probabilities and durations that are remembered, and the agent its beliefs.

    Raises:
        UsageError: There is no memory that can be trusted.
    """
    try:
        with open_memory_reader(folder / MEMORY_FILE) as memory:
            source = memory.experience_on(plant)
            return with_experience(ecm, source), experienced_beliefs(ecm, source)
    except AgentError as refusal:
        raise UsageError(str(refusal)) from refusal


def _apply_overrides(
    ecm: Ecm, tasks: Iterable[Task], arguments: argparse.Namespace
) -> tuple[Ecm, list[Task]]:
    """Apply --probability and --max-retries to the module and its tasks."""
    chances: dict[str, dict[str, Fraction]] = {}
    for skill, outcome, value in arguments.probability:
        chances.setdefault(skill, {})[outcome] = value
    return with_skill_probabilities(ecm, chances), [
        with_retries(one, dict(arguments.max_retries)) for one in tasks
    ]


def _prediction_json(ecm: Ecm, task: Task, site: Site, replans: int, beliefs: AgentBeliefs) -> dict[str, Any]:
    """Compute a prediction as JSON.

    Raises:
        UserError: The task has no prediction.
    """
    try:
        system = TransitionSystem(ecm, replace(task, invariants=()), site, beliefs)
        values = initial_values(site, with_defined_predicates(to_doubles(task.start), known_definitions(ecm)))
        prediction = _found_json(system, values, replans)
    except StateSpaceError as why:
        headline = f"nothing can be predicted of `{task.id}`: {why}"
        raise UserError([Diagnostic("AE803", headline, SpanLabel(task.span))]) from why
    return {
        "module": ecm.id,
        "task": task.id,
        "site": site.id,
        "replans_at_most": replans,
        "start": {name: values[name] for name in system.names},
        **prediction,
    }


def _found_json(system: TransitionSystem, values: Mapping[str, Any], replans: int) -> dict[str, Any]:
    """Predict exactly, or else bound the success.

    The order of parallel branches decides, too, in which state a step failed. So the upper bound is that of
    an agent that never gives up, and the lower one that of an agent that gives up no later than this one.

    Raises:
        StateSpaceError: The chain is too large.
    """
    try:
        prediction = predict(system, system.start(values), replans)
    except InexactError as why:
        soonest, never = system.giving_up_soonest(), system.never_giving_up()
        at_least = bound_success(soonest, soonest.start(values), replans).at_least
        at_most = bound_success(never, never.start(values), replans).at_most
        return {
            "reason": str(why),
            "success_at_least": _number(at_least, ROUND_FLOOR),
            "success_at_most": _number(at_most, ROUND_CEILING),
        }
    return {
        "failure": _number(1 - prediction.success),
        **{name: _number(value) for name, value in asdict(prediction).items() if value is not None},
    }


def _number(value: Fraction, rounding: str | None = None) -> dict[str, Any]:
    """Encode a number; its decimal is the nearest double, or one of 12 digits that is rounded to one side."""
    # Via Decimal: Python does not print integers of more than 4,300 digits.
    parts = [str(Decimal(part)) for part in value.as_integer_ratio()]
    decimal = float(value)
    if rounding is not None:
        with localcontext(prec=60, rounding=rounding):
            whole = Decimal(value.numerator) / Decimal(value.denominator)
        decimal = float(whole.quantize(Decimal("1e-12"), rounding=rounding))
    return {"exact": parts[0] if parts[1] == "1" else "/".join(parts), "decimal": decimal}


def _shown(value: Any) -> str:
    return number_text(value) if isinstance(value, float) else str(value).lower()


def _print_text(one: dict[str, Any], *, is_first: bool) -> None:
    if not is_first:
        print()
    start = ", ".join(f"{name} = {_shown(value)}" for name, value in one["start"].items())
    head = f"{one['module']}.{one['task']} at {one['site']}, at most {one['replans_at_most']} re-plans"
    print_line(escape_invisible(head))
    print_line(escape_invisible(f"from {start}"))
    print_table([(label, *_number_cells(one[name])) for name, label in _LABELS.items() if name in one])
    if "reason" in one:
        print_line(escape_invisible(f"bounds only: {one['reason']}"))


def _number_cells(number: dict[str, Any]) -> tuple[str, str]:
    """Return the decimal of a number, and its fraction where that is short."""
    exact = number["exact"]
    return number_text(number["decimal"]), f"= {exact}" if len(exact) <= _LONGEST_FRACTION else ""
