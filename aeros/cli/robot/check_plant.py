"""`aeros check-plant`: hold a plant to the promises of its interface, by moving it in every way."""

from __future__ import annotations

import argparse
import importlib
import inspect
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from aeros.cli.arguments import add_command, existing_path
from aeros.cli.records.report import read_site
from aeros.cli.terminal.progress import ProgressLine
from aeros.cli.terminal.rendering import print_table
from aeros.cli.terminal.streams import print_data, print_line
from aeros.descriptions import describe_exception, type_name
from aeros.exit_codes import Exit, UsageError
from aeros.runtime.gate.configuration import Configuration
from aeros.session.plant_factory import PLANTS, PlantSetupError
from aeros.session.plant_provider import PlantProviderError, load_provider
from aeros.sim.conformance.plant_under_test import ConformanceError, PlantUnderTest
from aeros.sim.conformance.suite import CHECKS, Check
from aeros.spec.text.discovery import reference_site_path

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

SCHEMA: Final = "aeros/plant-check/1"

_EXAMPLES: Final = """\
Each check makes a plant, moves, stops and halts it, and closes it.  So run this on the robot's own simulator
first.  What the plant cannot do is not tried: moves in contact, motions of arm and base at once, pictures,
unless its `PlantUnderTest` names actions for them.  That sensors measure what they name, and that limits and
geometry are those of the robot, no check can tell.

A simulator that comes with AEROS is checked with the robot of the site, which moves all joints from its
posture `ready`.

examples:
  aeros check-plant mujoco --site my_cell.yaml
  aeros check-plant turntable                the plant that an installed distribution provides under this name
  aeros check-plant my_robot.checks:SUBJECT  a `PlantUnderTest`, or a function that makes one
  aeros check-plant turntable --check stop_ends_everything
  aeros check-plant turntable --format json
"""

_OPTIONAL: Final = {
    "contact_actions": "moves in contact",
    "parallel_actions": "motions of arm and base at once",
    "look_action": "pictures",
}


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "check-plant", __doc__, _EXAMPLES)
    parser.add_argument("plant", metavar="NAME|MODULE:OBJECT", help="the plant")
    parser.add_argument(
        "--check",
        action="append",
        choices=[check.__name__ for check in CHECKS],
        metavar="CHECK",
        help="one check alone, by its name as printed; may be repeated (default: all)",
    )
    parser.add_argument(
        "--site",
        type=existing_path,
        help="the site file, for physics, mujoco and kinematic (default: the reference site)",
    )
    parser.add_argument("--format", choices=("text", "json"), default="text", help="default: text")
    parser.set_defaults(command=_command)


def _command(arguments: argparse.Namespace) -> Exit:
    subject = _subject(arguments.plant, arguments.site)
    chosen = [check for check in CHECKS if arguments.check is None or check.__name__ in arguments.check]
    results = []
    progress = ProgressLine(len(chosen))
    for number, check in enumerate(chosen):
        progress.show(_words(check), number)
        results.append(_result(check, subject))
        if arguments.format == "text":
            _print_result(results[-1])
    progress.end()
    missing = [words for name, words in _OPTIONAL.items() if not getattr(subject, name)]
    failed = sum(one["failure"] is not None for one in results)
    if arguments.format == "json":
        report = {"schema": SCHEMA, "plant": arguments.plant, "checks": results, "not_tried": missing}
        print_data(json.dumps(report, indent=1))
    else:
        print_line("")
        print_line(f"{len(results) - failed} of {len(results)} promises kept")
        if missing:
            print_line(f"not tried  {', '.join(missing)}")
    return Exit.REJECTED if failed else Exit.SUCCESS


def _subject(given: str, site: Path | None) -> PlantUnderTest:
    """Find the plant and the statements of its author.

    Raises:
        UsageError: There is none, or its code fails.
        UserError: The site has problems.
    """
    if given in PLANTS:
        return _simulator(given, site)
    if site is not None:
        raise UsageError(f"`--site` is for plants of AEROS; the subject of `{given}` brings its own robot")
    if ":" in given:
        return _imported(given)
    try:
        provider = load_provider(given, PLANTS)
    except PlantProviderError as error:
        raise UsageError(str(error)) from error
    if provider.subject is None:
        raise UsageError(f"the provider of `{given}` states no `subject`, which says what to hold it to")
    return _made(given, provider.subject)


def _simulator(name: str, path: Path | None) -> PlantUnderTest:
    # NumPy and the robot's model are imported only where they are asked for.
    from aeros.cli.robot.simulated_robot import SIMULATORS, simulated_robot

    if name not in SIMULATORS:
        raise UsageError(
            f"`{name}` has no robot; name one of {', '.join(SIMULATORS)}, or a plant of your own"
        )
    site = read_site(path or reference_site_path())
    try:
        return simulated_robot(name, Configuration(site, {}, {}, ""))
    except PlantSetupError as error:
        raise UsageError(str(error)) from error


def _imported(given: str) -> PlantUnderTest:
    module, _, name = given.partition(":")
    here = str(Path.cwd())
    if here not in sys.path:  # as `python -m` does
        sys.path.insert(0, here)
    try:
        found = getattr(importlib.import_module(module), name)
    except Exception as failure:
        reason = describe_exception(failure, one_line=True)
        raise UsageError(f"`{given}` cannot be imported: {reason}") from failure
    return found if isinstance(found, PlantUnderTest) else _made(given, found)


def _made(given: str, make: Any) -> PlantUnderTest:
    try:
        subject = make()
    except Exception as failure:
        reason = describe_exception(failure, one_line=True)
        raise UsageError(f"`{given}` makes no `PlantUnderTest`: {reason}") from failure
    if not isinstance(subject, PlantUnderTest):
        raise UsageError(f"`{given}` makes an object of type {type_name(subject)}, not a `PlantUnderTest`")
    return subject


def _result(check: Check, subject: PlantUnderTest) -> dict[str, Any]:
    failure = None
    try:
        check(subject)
    except ConformanceError as broken:
        failure = str(broken)
    except Exception as broken:
        failure = f"the plant raised {describe_exception(broken, one_line=True)}"
    promise = (inspect.getdoc(check) or "").splitlines()[0].removeprefix("Check that ")
    return {"check": check.__name__, "promise": promise[:1].upper() + promise[1:], "failure": failure}


def _print_result(result: dict[str, Any]) -> None:
    kept = result["failure"] is None
    words = result["check"].replace("_", " ")
    print_table([("kept" if kept else "BROKEN", words)], least=(len("BROKEN"),))
    if not kept:
        print_table([("promise", result["promise"]), ("found", result["failure"])], indent=8)


def _words(check: Check) -> str:
    return check.__name__.replace("_", " ")
