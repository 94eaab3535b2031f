"""`aeros mcp`: serve the robot to an MCP client, which can read state and propose plans to execute."""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from aeros.apps.mcp.approvals import Approvals
from aeros.apps.mcp.cancellable_runtime import CancellableRuntime
from aeros.apps.mcp.plan_review import ClientPlanChecker
from aeros.apps.mcp.robot import ClientPlanner, LatestMeasurements, McpEvents, McpRobotThread, RobotParts
from aeros.apps.mcp.task_choice import TaskChoice, start_tasks
from aeros.apps.mcp.tools import Tools
from aeros.apps.mcp.transports.http_address import (
    HttpAddress,
    HttpAddressError,
    open_listener,
    parse_address,
    server_url,
)
from aeros.apps.mcp.transports.standard_input import standard_input_problem
from aeros.apps.mcp.transports.token_file import TOKEN_FILE, TokenError, ensure_token
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
from aeros.exit_codes import Exit, UsageError
from aeros.files import private_umask
from aeros.runtime.audit.checkpoints import SigningConfiguration
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.registry.control_page import request_command
from aeros.runtime.registry.registry import Registry
from aeros.session.assembly import SessionSetup, open_agent, open_recorded_plant
from aeros.session.joined_tasks import joined_task
from aeros.session.plant_factory import PlantSetupError, load_run_scene, open_plant
from aeros.session.run_governor import RunGovernor
from aeros.session.setup import (
    AUDIT,
    SETUP_ERRORS,
    build_signing,
    create_output_folder,
    find_signing_key,
    open_governor,
)
from aeros.spec.diagnostics.codes import did_you_mean
from aeros.spec.diagnostics.render import escape_invisible
from aeros.spec.model.ecm import Task

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_EXAMPLES = """\
A client can read skills, tasks, state, manifests, policy and records, have plans checked as by
`aeros plan check`, and have accepted plans executed, with the same agent, gate and audit log as `aeros run`.
Each plan names its task; with an instruction, that task is the default, and the simulator has only its scene.
Unless the site's `policy.mcp` says otherwise, each execution waits for `aeros approve` in another terminal.
`aeros pause`, `resume` and `stop` work as for a run.  A cancelled call of `execute_plan` stops the motion.
Without --http one client starts this command and communicates over standard input and output; the robot
stops when it disconnects.  With --http several clients connect, each with the token of STATE/mcp-token; a
plan stops when no client has waited for it for 10 s.  Needs the extra `mcp`.

examples:
  aeros mcp --plant symbolic
  aeros mcp "make dumplings" --plant symbolic
  aeros mcp "clean the table" --state /srv/robot7 --site cell.yaml --ecms ecms
  aeros mcp --plant symbolic --http 8765
  entry of a client's configuration:
    {"mcpServers": {"robot": {"command": "aeros", "args": ["mcp", "make dumplings", "--state", "/srv/r7"]}}}
"""


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "mcp", __doc__, _EXAMPLES)
    parser.add_argument(
        "instruction",
        nargs="?",
        help='the task of plans that name none, as in "make dumplings" (default: each plan names its task)',
    )
    parser.add_argument("--seed", type=parse_seed, default=0, help="seed of all random numbers (default: 0)")
    add_plant_argument(parser)
    parser.add_argument("--site", type=existing_path, help="the site file (default: as for `aeros run`)")
    add_module_folders(parser, "the modules (default: as for `aeros run`)")
    add_module_settings(parser)
    parser.add_argument("--out", type=Path, help="a new folder for trace and audit log (default: in runs/)")
    parser.add_argument(
        "--state", type=Path, default=Path(".aeros"), help="the agent's own folder (default: .aeros)"
    )
    parser.add_argument(
        "--http",
        metavar="[HOST:]PORT",
        help="serve over HTTP at this address of this host, 127.0.0.1 if HOST is missing; port 0 for any",
    )
    parser.add_argument(
        "--token-file",
        type=Path,
        metavar="FILE",
        help="token that HTTP clients present; made if missing (default: STATE/mcp-token)",
    )
    add_signing(parser)
    parser.set_defaults(command=_command)


def _command(arguments: argparse.Namespace) -> Exit:
    if find_spec("mcp") is None:
        print(f"aeros: the MCP SDK is not installed: {install_command('mcp')}", file=sys.stderr)
        return Exit.USAGE
    require_signing_options(arguments)
    address = None
    if arguments.http is not None:
        try:
            address = parse_address(arguments.http)
        except HttpAddressError as error:
            raise UsageError(f"--http: {error}") from error
    elif arguments.token_file is not None:
        raise UsageError("--token-file is for clients over HTTP: give --http, too")
    elif (problem := standard_input_problem()) is not None:
        raise UsageError(problem)
    with private_umask():
        return _serve(arguments, address)


def _serve(arguments: argparse.Namespace, address: HttpAddress | None) -> Exit:
    governor, configuration, _ = open_governor(
        arguments.state,
        arguments.ecms,
        arguments.site,
        configurations=module_configurations(arguments),
    )
    try:
        warn_of_withheld_modules(governor)
        key = None if arguments.unsigned else find_signing_key(arguments.state, arguments.audit_key)
        tasks = TaskChoice(arguments.instruction, configuration.modules, governor.inactive_modules)
        at_start = start_tasks(tasks, configuration.modules)
        transport = _open_transport(arguments, address)
        out = create_output_folder(arguments.out, "mcp" if tasks.default is None else f"mcp-{at_start[0].id}")
        signing = None if key is None else build_signing(key, arguments.state, out, arguments.anchor)
        with governor, RunGovernor(governor) as run_governor:
            _warn_of_unknown_skills(configuration)
            former = signal.signal(signal.SIGTERM, lambda _number, _frame: run_governor.interrupt())
            measurements = LatestMeasurements()

            @contextmanager
            def opened() -> Iterator[RobotParts]:
                with _open_robot(
                    arguments, configuration, run_governor, at_start, out, signing, measurements, events
                ) as one:
                    yield one

            events = McpEvents()
            robot = McpRobotThread(opened, run_governor.interrupt)
            events.robot = robot
            try:
                folder = Registry(arguments.state).folder
                tools = Tools(
                    robot,
                    measurements,
                    tasks,
                    Approvals(arguments.state),
                    lambda command: request_command(folder, command),
                    lambda: run_governor.command,
                )
                print(f"aeros: serving MCP on {transport.name}; output in {out}/", file=sys.stderr)
                transport.serve(tools, out / AUDIT, lambda: run_governor.is_interrupted)
                by_signal = run_governor.is_interrupted
            finally:
                try:
                    robot.close()
                finally:
                    signal.signal(signal.SIGTERM, former)
    except (*SETUP_ERRORS, TokenError) as refusal:
        print(f"aeros: {refusal}", file=sys.stderr)
        return Exit.REJECTED
    return Exit.INTERRUPTED if by_signal else Exit.SUCCESS


class _Transport(NamedTuple):
    """Way in which clients connect.

    Attributes:
        name: Text for the operator.
        serve: Serves clients with tools and audit log until a function returns true.
    """

    name: str
    serve: Callable[[Tools, Path, Callable[[], bool]], None]


def _open_transport(arguments: argparse.Namespace, address: HttpAddress | None) -> _Transport:
    from aeros.apps.mcp.resources import Resources
    from aeros.apps.mcp.server import build_server

    if address is None:
        from aeros.apps.mcp.transports.stdio import serve_stdio

        return _Transport(
            "stdio",
            lambda tools, log, is_over: serve_stdio(
                build_server(tools, Resources(tools, log)), is_over, print_warning
            ),
        )
    from aeros.apps.mcp.transports.http_server import UNATTENDED_LIMIT_S, serve_http

    token_file = arguments.token_file or arguments.state / TOKEN_FILE
    token = ensure_token(token_file)
    try:
        listener = open_listener(address)
    except OSError as error:
        raise PlantSetupError(f"cannot listen at `{arguments.http}`: {error.strerror}") from error
    if not address.is_loopback:
        print_warning(f"{address.host} can be reached from the network, and HTTP sends the token in the open")

    def serve(tools: Tools, log: Path, is_over: Callable[[], bool]) -> None:
        server = build_server(tools, Resources(tools, log))
        serve_http(server, listener, token, lambda: tools.cancel_unattended(UNATTENDED_LIMIT_S), is_over)

    return _Transport(f"{server_url(listener)} with the token of {token_file}", serve)


@contextmanager
def _open_robot(
    arguments: argparse.Namespace,
    configuration: Configuration,
    governor: RunGovernor,
    tasks: Sequence[Task],
    out: Path,
    signing: SigningConfiguration | None,
    measurements: LatestMeasurements,
    events: McpEvents,
) -> Iterator[RobotParts]:
    """Open plant, gate, audit log and agent, as `aeros run` does."""
    planner = ClientPlanner(ClientPlanChecker(lambda: robot.executor.site))
    plant, seed = arguments.plant, arguments.seed
    scene = load_run_scene(plant, None, configuration, tasks, seed)
    setup = SessionSetup(
        configuration=configuration,
        open_plant=lambda _: open_plant(plant, configuration, joined_task(tasks), seed, scene=scene),
        out=out,
        state=arguments.state,
        warn=print_warning,
        stream=sys.stderr,
        signing=signing,
        on_event=events.on_event,
        listeners=(measurements,),
        planner=planner,
        seed=seed,
        plant_name=plant,
        wrap_runtime=lambda executor: CancellableRuntime(executor, events.cancel_reason),
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
