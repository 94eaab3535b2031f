"""`aeros mcp`: serve the robot to an MCP client, which can read state and propose plans to execute."""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from aeros.agent.instructions.meaning import single_errand
from aeros.agent.planning.routing import RoutedTask
from aeros.apps.mcp.approvals import Approvals
from aeros.apps.mcp.plan_review import ClientPlanChecker
from aeros.apps.mcp.robot import ClientPlanner, LatestMeasurements, McpRobotThread, RobotParts
from aeros.apps.mcp.tools import Tools
from aeros.cli.arguments import (
    add_command,
    add_module_folders,
    add_signing,
    existing_path,
    parse_seed,
    print_warning,
    require_signing_options,
    warn_of_withheld_modules,
)
from aeros.cli.latest_run import save_latest_run
from aeros.cli.module_settings import add_module_settings, module_configurations
from aeros.cli.plant_argument import add_plant_argument
from aeros.distribution import install_command
from aeros.exit_codes import Exit
from aeros.files import private_umask
from aeros.runtime.audit.checkpoints import SigningConfiguration
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.registry.control_page import request_command
from aeros.runtime.registry.registry import Registry
from aeros.session.assembly import SessionSetup, open_agent, open_recorded_plant
from aeros.session.plant_factory import open_plant
from aeros.session.run_governor import RunGovernor
from aeros.session.setup import (
    SETUP_ERRORS,
    build_signing,
    create_output_folder,
    find_signing_key,
    open_governor,
    understand_instruction,
)
from aeros.spec.diagnostics.codes import did_you_mean
from aeros.spec.diagnostics.render import escape_invisible

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_EXAMPLES = """\
A client starts this command and communicates with it over standard input and output.  It can read skills
and state, have plans checked as by `aeros plan check`, and have accepted plans executed, with the same
agent, gate and audit log as `aeros run`.  Unless the site's `policy.mcp` says otherwise, each execution
waits for `aeros approve` in another terminal.  `aeros pause`, `resume` and `stop` work as for a run.  The
robot stops when the client disconnects.  Needs the extra `mcp`.

examples:
  aeros mcp "make dumplings" --plant symbolic
  aeros mcp "clean the table" --state /srv/robot7 --site cell.yaml --ecms ecms
  entry of a client's configuration:
    {"mcpServers": {"robot": {"command": "aeros", "args": ["mcp", "make dumplings", "--state", "/srv/r7"]}}}
"""


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "mcp", __doc__, _EXAMPLES)
    parser.add_argument("instruction", help='the task for which the robot is set up, as in "make dumplings"')
    parser.add_argument("--seed", type=parse_seed, default=0, help="seed of all random numbers (default: 0)")
    add_plant_argument(parser)
    parser.add_argument("--site", type=existing_path, help="the site file (default: as for `aeros run`)")
    add_module_folders(parser, "the modules (default: as for `aeros run`)")
    add_module_settings(parser)
    parser.add_argument("--out", type=Path, help="a new folder for trace and audit log (default: in runs/)")
    parser.add_argument(
        "--state", type=Path, default=Path(".aeros"), help="the agent's own folder (default: .aeros)"
    )
    add_signing(parser)
    parser.set_defaults(command=_command)


def _command(arguments: argparse.Namespace) -> Exit:
    if find_spec("mcp") is None:
        print(f"aeros: the MCP SDK is not installed: {install_command('mcp')}", file=sys.stderr)
        return Exit.USAGE
    require_signing_options(arguments)
    with private_umask():
        return _serve(arguments)


def _serve(arguments: argparse.Namespace) -> Exit:
    from aeros.apps.mcp.server import serve

    governor, configuration, _ = open_governor(
        arguments.state,
        arguments.ecms,
        arguments.site,
        configurations=module_configurations(arguments),
    )
    try:
        warn_of_withheld_modules(governor)
        key = None if arguments.unsigned else find_signing_key(arguments.state, arguments.audit_key)
        routed = single_errand(understand_instruction(arguments.instruction, configuration, governor))
        out = create_output_folder(arguments.out, f"mcp-{routed.task.id}")
        signing = None if key is None else build_signing(key, arguments.state, out, arguments.anchor)
        with governor, RunGovernor(governor) as run_governor:
            _warn_of_unknown_skills(configuration)
            former = signal.signal(signal.SIGTERM, lambda _number, _frame: run_governor.interrupt())
            measurements = LatestMeasurements()

            @contextmanager
            def opened() -> Iterator[RobotParts]:
                with _open_robot(
                    arguments, configuration, run_governor, routed, out, signing, measurements
                ) as one:
                    yield one

            robot = McpRobotThread(opened, arguments.instruction, run_governor.interrupt)
            try:
                folder = Registry(arguments.state).folder
                tools = Tools(
                    robot,
                    measurements,
                    routed,
                    Approvals(arguments.state),
                    lambda command: request_command(folder, command),
                    lambda: run_governor.command,
                )
                print(f"aeros: serving MCP on stdio; output in {out}/", file=sys.stderr)
                serve(tools, lambda: run_governor.is_interrupted)
                by_signal = run_governor.is_interrupted
            finally:
                try:
                    robot.close()
                finally:
                    signal.signal(signal.SIGTERM, former)
    except SETUP_ERRORS as refusal:
        print(f"aeros: {refusal}", file=sys.stderr)
        return Exit.REJECTED
    return Exit.INTERRUPTED if by_signal else Exit.SUCCESS


@contextmanager
def _open_robot(
    arguments: argparse.Namespace,
    configuration: Configuration,
    governor: RunGovernor,
    routed: RoutedTask,
    out: Path,
    signing: SigningConfiguration | None,
    measurements: LatestMeasurements,
) -> Iterator[RobotParts]:
    """Open plant, gate, audit log and agent, as `aeros run` does."""
    planner = ClientPlanner(ClientPlanChecker(lambda: robot.executor.site))
    setup = SessionSetup(
        configuration=configuration,
        open_plant=lambda _: open_plant(arguments.plant, configuration, routed.task, arguments.seed),
        out=out,
        state=arguments.state,
        warn=print_warning,
        stream=sys.stderr,
        signing=signing,
        listeners=(measurements,),
        planner=planner,
        seed=arguments.seed,
        plant_name=arguments.plant,
    )
    with open_recorded_plant(setup) as recorded, open_agent(setup, recorded, governor) as robot:
        save_latest_run(arguments.state, out)
        yield RobotParts(robot.executor, robot.agent, planner)


def _warn_of_unknown_skills(configuration: Configuration) -> None:
    known = {f"{ecm.id}.{skill}" for ecm in configuration.modules.values() for skill in ecm.skills}
    for name in sorted((configuration.site.mcp.skills or frozenset()) - known):
        near = did_you_mean(name, known)
        hint = f"; did you mean `{near}`?" if near else ""
        print(
            f"aeros: warning: `policy.mcp.skills` names `{escape_invisible(name)}`, "
            f"which no active module has{hint}",
            file=sys.stderr,
        )
