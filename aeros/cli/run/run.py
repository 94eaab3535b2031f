"""`aeros run`: run one agent that pursues an instruction on a plant; the gate decides every action."""

from __future__ import annotations

import argparse
import shlex
import sys
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Final

from aeros.agent.errors import AgentError
from aeros.agent.identity import lock_folder
from aeros.agent.instructions.meaning import single_errand, with_goal
from aeros.agent.recovery.checkpoint import CheckpointStore
from aeros.agent.recovery.quarantine import Quarantine
from aeros.apps.dataset.dataset import DatasetError
from aeros.apps.goal import parse_goal
from aeros.apps.watchdog.resumable_run import load_run_options, save_run_options
from aeros.apps.watchdog.watchdog import run_watchdog
from aeros.cli.arguments import (
    add_command,
    add_module_folders,
    add_signing,
    as_port,
    existing_path,
    film_path,
    mcap_path,
    parse_seed,
    require_signing_options,
    warn_of_withheld_modules,
)
from aeros.cli.module_settings import add_module_settings, module_configurations
from aeros.cli.plant_argument import add_plant_argument
from aeros.cli.records.dataset import open_run_dataset
from aeros.cli.ros2_options import add_ros2_options, require_ros2_options
from aeros.cli.run.planners import LLM_KEY, build_planner
from aeros.cli.run.reading import find_meaning
from aeros.cli.run.run_plant import (
    PlantSetup,
    load_scene_extras,
    open_outputs,
    plant_socket,
    serve_plant,
)
from aeros.cli.run.run_task import RunRequest, run_task
from aeros.exit_codes import Exit, UsageError
from aeros.files import private_umask
from aeros.runtime.bus.recording.topic_choice import ChosenTopic, TopicChoiceError
from aeros.runtime.gate.gate import GateMode
from aeros.runtime.ports import PlantLostError
from aeros.runtime.registry.registry import Registry
from aeros.runtime.registry.registry_governor import OperatorCommands
from aeros.session.joined_tasks import joined_task, request_for_goal, tasks_of
from aeros.session.plant_factory import PlantSetupError
from aeros.session.setup import (
    SETUP_ERRORS,
    build_signing,
    create_output_folder,
    find_signing_key,
    open_governor,
)

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_EXAMPLES = """\
All modules are proved before anything moves.  Each must have an `ecm.lock` of its present files, and one
of this site must equal the resulting certificate.
The folder of --out gets trace.jsonl (events of the agent), measured.jsonl (measurements, ten a second),
audit.jsonl (every decision, hash-chained), poses.jsonl (physics), from which `aeros film` makes a film at any
time, and with --report an HTML page.
The exit code is 0 if the goal is reached, else 1.
Blocks, policy and withdrawn modules of the state folder bind the run, also with --ecms or --site, and also
if they change while it runs (`aeros block`, `deactivate`, `policy`, `stop`; docs/lifecycle.md).
An instruction is understood whole or refused: each word must be declared by a task (`aeros tasks`).
With --planner llm a language model reads it, too: both meanings must agree, or you confirm the model's.
Ctrl-C stops the robot; a film, bag or MCAP file is complete up to then.  After a kill there is none.
Simulated people walk scripted paths and ignore the robot; it slows down or stops as the site demands.
A composition is a graph of skills that the module declares; its branches run at the same time.
The planner smt plans for any goal from preconditions and outcomes, without planning rules (`aeros plan`).

examples:
  aeros run "make dumplings"
  aeros run "clean the table" --seed 7 --out runs/clean
  aeros run "make dumplings, then clean the table" --plant symbolic
  aeros run "if the table is dirty, clean it, but do not make dumplings" --plant symbolic
  aeros run --task fetch_object object=blue_block
  aeros run "make dumplings" --plant symbolic --gate compiled
  aeros run "fetch the object" --plant kinematic --seed 3
  aeros run "fetch the object" --composition fetch_once --timeout 60
  aeros run "make dumplings" --planner smt --planning-timeout 5
  aeros run "make dumplings" --planner pddl --pddl-engine pyperplan
  aeros run "make dumplings" --planner llm --llm-url http://localhost:11434/v1 --llm-model qwen3
  aeros run "make dumplings" --goal "dumpling_wrapped and not dumpling_cooked"
  aeros run "fetch the object" --people across_the_room
  aeros run "make dumplings" --faults wrapper_bumped --seed 4
  aeros run "make dumplings" --film dumplings.mp4 --mcap dumplings.mcap
  aeros run "make dumplings" --live
  aeros run "make dumplings" --view --no-film
  aeros run "make dumplings" --people at_the_bench --report
  aeros run "fetch the object" --scene shelf_behind
  aeros run "fetch the object" --randomise --seed 12
  aeros run "make dumplings" --bag runs/demo-bag
  aeros run "make dumplings" --plant mujoco --seed 3 --dataset runs/dumplings
  aeros run "make dumplings" --ros2
  aeros run "make dumplings" --watchdog
  aeros run --resume
  aeros run "make dumplings" --anchor /mnt/other/demo.anchor
"""


LIVE_PORT: Final = 8765
"""Port of `--live` if none is given; Foxglove tries it first."""

_AGENT_EXIT_TIMEOUT_S: Final = 30.0
"""Seconds to wait for an earlier agent to end."""


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "run", __doc__, _EXAMPLES)
    parser.add_argument("instruction", nargs="?", help='the instruction, as in "make dumplings"')
    parser.add_argument(
        "--task",
        nargs="+",
        metavar=("NAME", "KEY=VALUE"),
        help="the task with values of its parameters, in place of an instruction; `aeros tasks` lists them",
    )
    parser.add_argument("--seed", type=parse_seed, default=0, help="seed of all random numbers (default: 0)")
    add_plant_argument(parser)
    parser.add_argument(
        "--gate",
        choices=[mode.value for mode in GateMode],
        default=GateMode.CHECKED.value,
        help="how conditions are decided; checked asks the compiled gate and Z3, and halts if they disagree "
        "(default: checked)",
    )
    parser.add_argument(
        "--site",
        type=existing_path,
        help="the site file (default: the policy in force on this robot, or else the reference site)",
    )
    add_module_folders(
        parser,
        "the modules to load, with those that they require and that lie next to them (default: those "
        "that are active on this robot; without a robot `ecms`, or else those that come with AEROS)",
    )
    add_module_settings(parser)
    parser.add_argument(
        "--out", type=Path, help="a new folder for poses, trace and audit log (default: in runs/)"
    )
    parser.add_argument(
        "--state", type=Path, default=Path(".aeros"), help="the agent's own folder (default: .aeros)"
    )
    parser.add_argument(
        "--composition",
        metavar="NAME",
        help="run this composition of the module instead of its planning rules",
    )
    parser.add_argument(
        "--planner",
        choices=("rules", "smt", "pddl", "llm"),
        help="how to plan: the task's rules, built-in search, a classical planner, or a language model "
        "(default: rules; smt with --goal)",
    )
    parser.add_argument(
        "--pddl-engine",
        metavar="NAME",
        help="classical planner of --planner pddl, by its name in unified-planning (default: its choice)",
    )
    parser.add_argument(
        "--llm-url",
        metavar="URL",
        help=f"OpenAI-compatible API, as in http://localhost:11434/v1; reads its key from {LLM_KEY}",
    )
    parser.add_argument("--llm-model", metavar="NAME", help="the language model")
    parser.add_argument("--goal", metavar="EXPR", help="goal condition that replaces the task's goal")
    parser.add_argument(
        "--planning-timeout",
        type=_seconds,
        metavar="SECONDS",
        help="time limit for planning, while the plant's clock runs on "
        "(default and maximum: the site's limit)",
    )
    parser.add_argument(
        "--timeout",
        type=_seconds,
        metavar="SECONDS",
        help="cancel the task after this time on the plant's clock (default: only skills have timeouts)",
    )
    kept = parser.add_mutually_exclusive_group()
    kept.add_argument(
        "--bag",
        type=Path,
        metavar="FOLDER",
        help="record decisions, joints, transforms and measurements as a ROS 2 bag in this new folder",
    )
    kept.add_argument(
        "--mcap",
        type=mcap_path,
        metavar="FILE",
        help="record the same in this new MCAP file, for example for Foxglove",
    )
    parser.add_argument(
        "--keep",
        type=_chosen_topic,
        action="append",
        default=[],
        metavar="TOPIC[=HZ]",
        help="with --bag or --mcap: record this topic, at most so often in a second; may be given again, and "
        "`*` stands for any characters (default: all messages of all topics)",
    )
    add_ros2_options(parser)
    parser.add_argument(
        "--live",
        nargs="?",
        type=_port,
        const=LIVE_PORT,
        metavar="PORT",
        help=f"show the run to Foxglove and other viewers at this port of 127.0.0.1 (default: {LIVE_PORT})",
    )
    parser.add_argument(
        "--people",
        metavar="FILE|NAME",
        help="simulated people: a people file or a shipped name (physics)",
    )
    parser.add_argument(
        "--faults",
        metavar="FILE|NAME",
        help="inject faults: a faults file or a shipped name (physics)",
    )
    parser.add_argument(
        "--ideal-sensors",
        action="store_true",
        help="simulate sensors without the noise, latency, dropout and drift that the site declares",
    )
    parser.add_argument(
        "--randomise",
        action="store_true",
        help="draw masses, friction, colours, light, places and sensor errors from the ranges in scene files",
    )
    parser.add_argument(
        "--scene",
        metavar="FILE|NAME",
        help="extra objects: a scene file or its name; one with a robot replaces the task's scene (physics)",
    )
    parser.add_argument(
        "--report", action="store_true", help="write report.html there too, as `aeros report` does"
    )
    parser.add_argument(
        "--dataset",
        type=Path,
        metavar="FOLDER",
        help="add the run as an episode to a dataset in LeRobot's format; the folder is new or has one",
    )
    film = parser.add_mutually_exclusive_group()
    film.add_argument(
        "--film",
        type=film_path,
        metavar="FILE",
        help="film to make when the run is over (physics): *.mp4, *.webp or *.gif, as `aeros film` does",
    )
    film.add_argument("--no-film", action="store_true", help="record no poses, from which films are made")
    parser.add_argument(
        "--view", action="store_true", help="show the run in a window (physics); needs a display"
    )
    add_signing(parser)
    surviving = parser.add_argument_group("survival", "see docs/survival.md")
    surviving.add_argument(
        "--watchdog",
        action="store_true",
        help="run the agent under a watchdog that restarts it after a crash",
    )
    surviving.add_argument(
        "--resume",
        action="store_true",
        help="resume the interrupted task",
    )
    surviving.add_argument(
        "--max-crashes",
        type=_count,
        default=5,
        metavar="N",
        help="crashes within --crash-window that trigger quarantine (default: 5)",
    )
    surviving.add_argument(
        "--crash-window",
        type=_seconds,
        default=600.0,
        metavar="SECONDS",
        help="time window of --max-crashes (default: 600)",
    )
    surviving.add_argument(
        "--heartbeat-timeout",
        type=_seconds,
        default=60.0,
        metavar="SECONDS",
        help="kill an agent without a heartbeat for this long (default: 60)",
    )
    surviving.add_argument("--serve-plant", action="store_true", help=argparse.SUPPRESS)
    surviving.add_argument("--supervised", action="store_true", help=argparse.SUPPRESS)
    parser.set_defaults(command=_command, plant_at=None)


def _count(text: str) -> int:
    if not text.isascii() or not text.isdigit() or not 0 < int(text) < 2**31:
        raise argparse.ArgumentTypeError("expected a whole number above 0")
    return int(text)


def _chosen_topic(text: str) -> ChosenTopic:
    try:
        return ChosenTopic.parse(text)
    except TopicChoiceError as refusal:
        raise argparse.ArgumentTypeError(str(refusal)) from refusal


def _port(text: str) -> int:
    port = as_port(text)
    if port is None:
        raise argparse.ArgumentTypeError("expected a port from 0 to 65535; an instruction goes before --live")
    return port


def _seconds(text: str) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = 0.0
    if not 0.0 < seconds < inf:
        raise argparse.ArgumentTypeError("expected a number of seconds above 0")
    return seconds


def _command(arguments: argparse.Namespace) -> Exit:
    is_going_on = arguments.resume or arguments.serve_plant
    if arguments.task is not None and arguments.instruction is None:
        arguments.instruction = shlex.join(arguments.task)
    elif arguments.task is not None:
        raise UsageError("give an instruction or --task, not both")
    is_goal_alone = arguments.goal is not None and arguments.instruction is None
    if is_goal_alone and arguments.watchdog:
        raise UsageError("with --watchdog, give an instruction or --task NAME together with --goal")
    if is_going_on != (arguments.instruction is None) and not (is_goal_alone and not is_going_on):
        raise UsageError("give an instruction, --task NAME or --goal, or --resume without them")
    require_signing_options(arguments)
    require_ros2_options(arguments)
    if arguments.keep and arguments.bag is None and arguments.mcap is None:
        raise UsageError("--keep chooses topics of a recording: give --bag FOLDER or --mcap FILE, too")
    if arguments.resume:
        for option in ("ros2", "live", "dataset", "bag", "mcap", "film"):
            if getattr(arguments, option):
                raise UsageError(f"--resume goes on with the options of the run: leave out --{option}")
    with private_umask():
        return _run(arguments, is_going_on=is_going_on)


def _run(arguments: argparse.Namespace, *, is_going_on: bool) -> Exit:
    try:
        if is_going_on:
            arguments = load_run_options(arguments)
        if arguments.watchdog:
            return _run_watchdog(arguments)
        if not arguments.resume:
            return _run_agent(arguments)
        # Wait for an earlier agent: one whose watchdog was killed may still be ending.
        with lock_folder(arguments.state / "task", arguments.instruction, _AGENT_EXIT_TIMEOUT_S):
            return _run_agent(arguments)
    except (AgentError, PlantSetupError) as refusal:
        print(f"aeros: {refusal}", file=sys.stderr)
        return Exit.REJECTED


def _run_watchdog(arguments: argparse.Namespace) -> Exit:
    """Run the task under a watchdog; there is at most one for each state folder.

    Raises:
        UsageError: An option cannot be combined with --watchdog.
        AgentError: The agent is in quarantine.
    """
    if arguments.bag is not None or arguments.mcap is not None or arguments.live is not None:
        raise UsageError("--bag, --mcap and --live cannot be combined with --watchdog")
    if arguments.dataset is not None or arguments.randomise:
        raise UsageError("--dataset and --randomise cannot be combined with --watchdog")
    with lock_folder(arguments.state / "watchdog", arguments.instruction):
        quarantined = Quarantine(arguments.state).reason()
        if quarantined is not None:
            raise AgentError(quarantined)
        if not arguments.resume:
            with lock_folder(arguments.state, arguments.instruction):
                arguments.out = create_output_folder(arguments.out, "watched")
                arguments.plant_at = plant_socket()
                # The checkpoint of an earlier task must not be resumed.
                CheckpointStore(arguments.state).delete()
                # An earlier stop ended an earlier run; from here on a stop is for this one.
                OperatorCommands(Registry(arguments.state).folder, resumed=False).close()
                save_run_options(arguments)
        return run_watchdog(arguments)


def _run_agent(arguments: argparse.Namespace) -> Exit:
    governor, configuration, proof = open_governor(
        arguments.state,
        arguments.ecms,
        arguments.site,
        configurations=module_configurations(arguments),
        resumed=arguments.resume or arguments.serve_plant,
    )
    try:
        warn_of_withheld_modules(governor)
        is_signed = not (arguments.unsigned or arguments.serve_plant)
        key = find_signing_key(arguments.state, arguments.audit_key) if is_signed else None
        goal = None if arguments.goal is None else parse_goal(arguments.goal, configuration.site)
        if arguments.instruction is None and goal is not None:
            arguments.task = request_for_goal(goal, configuration)
            arguments.instruction = shlex.join(arguments.task)
        meaning = find_meaning(arguments, configuration, governor)
        # A choice that was made on the terminal holds for the rest of the run, and for `--resume`.
        arguments.instruction = meaning.instruction
        if arguments.composition is not None:
            single_errand(meaning)
        meaning = meaning if goal is None else with_goal(meaning, goal)
        module = configuration.modules[meaning.first.module]
        tasks = tasks_of(meaning, configuration, goal, module.compositions.get(arguments.composition))
        routed = replace(meaning.first, task=joined_task(tasks))
        follows_rules = all(errand.routed.task.rules for errand in meaning.errands)
        planner = build_planner(arguments, module, configuration.site, follows_rules=follows_rules)
        around = load_scene_extras(arguments, configuration, tasks)
        dataset = open_run_dataset(arguments, configuration, meaning)
        with open_outputs(arguments, routed.task.id) as (out, spectators), governor:
            staged = PlantSetup(arguments, configuration, routed, around, spectators, out)
            if arguments.serve_plant:
                return serve_plant(staged)
            signing = None if key is None else build_signing(key, arguments.state, out, arguments.anchor)
            return run_task(staged, RunRequest(governor, proof, planner, meaning, goal, signing, dataset))
    except (*SETUP_ERRORS, DatasetError) as refusal:
        print(f"aeros: {refusal}", file=sys.stderr)
        return Exit.REJECTED
    except PlantLostError as lost:
        # A supervisor may restart this process.
        print(f"aeros: the plant is lost: {lost}", file=sys.stderr)
        return Exit.INTERNAL_ERROR
