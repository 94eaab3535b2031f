"""`aeros serve`: an agent that waits for instructions of other processes on ROS 2."""

from __future__ import annotations

import argparse
import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Final

from aeros.agent.instructions.meaning import Understanding
from aeros.agent.instructions.refusals import InstructionError
from aeros.apps.ros2.instruction_goals import PURSUE, PURSUIT, InstructionGoals
from aeros.apps.ros2.robot_bus import RobotBus
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
from aeros.cli.ros2_options import add_ros2_options, open_peers, print_bus, require_ros2_options
from aeros.cli.terminal.rendering import print_labelled
from aeros.exit_codes import Exit, UsageError
from aeros.files import private_umask
from aeros.runtime.audit.checkpoints import SigningConfiguration
from aeros.runtime.bus.skill_action_server import EXECUTE, EXECUTE_SKILL, SkillGoals
from aeros.runtime.execution.governor import OperatorCommand
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.registry.registry_governor import RegistryGovernor
from aeros.session.assembly import SessionSetup, open_agent, open_recorded_plant
from aeros.session.joined_tasks import joined_task, tasks_of
from aeros.session.plant_factory import PHYSICS_PLANTS, PlantSetupError, load_run_scene, open_plant
from aeros.session.run_governor import RunGovernor
from aeros.session.setup import (
    SETUP_ERRORS,
    build_signing,
    create_output_folder,
    find_signing_key,
    open_governor,
    understand_instruction,
)
from aeros.spec.model.ecm import Task

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_EXAMPLES = """\
The instruction names the tasks that the robot is set up for; nothing moves before a client asks.
Clients send instructions to the action /aeros/pursue, with the same agent, gate and audit log as `aeros run`.
With --execute-skill they may also start single skills with the action /aeros/execute_skill.  Pause, resume
and stop are always offered.  Everybody who reaches the node may ask: by default processes of this machine.
The robot stops with Ctrl-C, `aeros stop` or /aeros/stop.

examples:
  aeros serve "make dumplings" --ros2 --plant kinematic
  aeros serve "clean the table" --ros2 --execute-skill --plant symbolic
  aeros serve "clean the table" --ros2 --ros-args -r __ns:=/robot7
"""

_POLL_INTERVAL_S: Final = 0.05


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "serve", __doc__, _EXAMPLES)
    parser.add_argument("instruction", help='the tasks that the robot is set up for, as in "make dumplings"')
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
        "--execute-skill", action="store_true", help="offer /aeros/execute_skill, too (default: not offered)"
    )
    add_signing(parser)
    add_ros2_options(parser)
    parser.set_defaults(command=_command)


def _command(arguments: argparse.Namespace) -> Exit:
    if not arguments.ros2:
        raise UsageError("give --ros2: nobody could ask for anything without it")
    require_ros2_options(arguments)
    require_signing_options(arguments)
    with private_umask():
        return _serve(arguments)


def _serve(arguments: argparse.Namespace) -> Exit:
    governor, configuration, _ = open_governor(
        arguments.state,
        arguments.ecms,
        arguments.site,
        configurations=module_configurations(arguments),
    )
    try:
        warn_of_withheld_modules(governor)
        key = None if arguments.unsigned else find_signing_key(arguments.state, arguments.audit_key)
        tasks = tasks_of(
            understand_instruction(arguments.instruction, configuration, governor), configuration
        )
        out = create_output_folder(arguments.out, f"serve-{tasks[0].id}")
        signing = None if key is None else build_signing(key, arguments.state, out, arguments.anchor)
        with governor, RunGovernor(governor) as run_governor:
            former = signal.signal(signal.SIGTERM, lambda _number, _frame: run_governor.interrupt())
            try:
                with open_peers(arguments, configuration) as peers:
                    if peers is not None:
                        _Server(arguments, configuration, governor, tasks, peers).run(
                            run_governor, out, signing
                        )
                        print_labelled("output", f"{out}/")
            finally:
                signal.signal(signal.SIGTERM, former)
    except SETUP_ERRORS as refusal:
        print(f"aeros: {refusal}", file=sys.stderr)
        return Exit.REJECTED
    return Exit.INTERRUPTED if run_governor.is_interrupted else Exit.SUCCESS


class _Server:
    """The robot and the goals that it serves."""

    def __init__(
        self,
        arguments: argparse.Namespace,
        configuration: Configuration,
        governor: RegistryGovernor,
        tasks: list[Task],
        peers: RobotBus,
    ) -> None:
        self._arguments = arguments
        self._configuration = configuration
        self._governor = governor
        self._tasks = tasks
        self._peers = peers

    def run(self, governor: RunGovernor, out: Path, signing: SigningConfiguration | None) -> None:
        """Serve goals until the operator stops the robot.

        Raises:
            PlantSetupError: `aeros_msgs` is not installed.
        """
        bus, arguments = self._peers.bus, self._arguments
        if "aeros_msgs" in bus.missing_for((*PURSUIT, *EXECUTE)):
            raise PlantSetupError(
                "`aeros serve` needs the ROS 2 package `aeros_msgs`, which its actions are made of: build it "
                "with colcon in your workspace, or with `aeros ros2-messages`"
            )
        instructions = InstructionGoals(bus.serve_action(PURSUE, PURSUIT), self._understand)
        setup = self._setup(out, signing, instructions)
        with (
            open_recorded_plant(setup) as recorded,
            open_agent(setup, self._peers.with_sensors(recorded), governor) as (executor, agent, _),
            self._peers.serve(recorded),
        ):
            save_latest_run(arguments.state, out)
            governor.on_command = lambda command: agent.set_paused(is_paused=command is OperatorCommand.PAUSE)
            server = bus.serve_action(EXECUTE_SKILL, EXECUTE) if arguments.execute_skill else None
            skills = None if server is None else SkillGoals(server, executor)
            print_bus(self._peers, f"waiting for {PURSUE}")
            try:
                while governor.command is not OperatorCommand.STOP:
                    # So that peers see the robot while it waits; what has not changed is not published again.
                    executor.observe()
                    if skills is not None:
                        skills.take_turn(0.0)
                    if skills is None or not skills.is_busy:
                        instructions.take_turn(agent, executor, _POLL_INTERVAL_S)
                if skills is not None:
                    skills.cancel_all()
            finally:
                instructions.close()
                if server is not None:
                    server.close()

    def _setup(
        self, out: Path, signing: SigningConfiguration | None, instructions: InstructionGoals
    ) -> SessionSetup:
        arguments, configuration = self._arguments, self._configuration
        task = joined_task(self._tasks)
        scene = load_run_scene(arguments.plant, None, configuration, self._tasks, arguments.seed)
        return SessionSetup(
            configuration=configuration,
            open_plant=lambda _: open_plant(
                arguments.plant, configuration, task, arguments.seed, scene=scene
            ),
            out=out,
            state=arguments.state,
            warn=print_warning,
            stream=sys.stdout,
            on_event=instructions.on_event,
            signing=signing,
            bus=self._peers.bus,
            seed=arguments.seed,
            plant_name=arguments.plant,
        )

    def _understand(self, instruction: str) -> Understanding:
        """Understand an instruction whose tasks take place where the robot is set up.

        Raises:
            InstructionError: It is not understood, or takes place elsewhere.
        """
        configuration = self._governor.configuration()[1]
        meaning = understand_instruction(instruction, configuration, self._governor)
        scenes = {task.scene for task in self._tasks}
        elsewhere = [task for task in tasks_of(meaning, configuration) if task.scene not in scenes]
        if self._arguments.plant in PHYSICS_PLANTS and elsewhere:
            raise InstructionError(
                f"`{elsewhere[0].id}` takes place in `{elsewhere[0].scene}`; the robot is set up for "
                f"{', '.join(f'`{one}`' for one in sorted(map(str, scenes)))}"
            )
        return meaning
