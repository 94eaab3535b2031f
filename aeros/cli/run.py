"""`aeros run`: one agent pursues an instruction on a plant, every action decided by the gate."""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, closing, contextmanager, suppress
from functools import partial
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

from aeros.agent.checkpoint import Checkpoints
from aeros.agent.errors import EndedError, RefusedError
from aeros.agent.identity import exclusive
from aeros.agent.journal import Event
from aeros.agent.loop import Agent, awake
from aeros.agent.planner import Planner
from aeros.agent.quarantine import Quarantine
from aeros.agent.routing import Routed
from aeros.cli.arguments import UsageError, existing_path, film_path, mcap_path, writable_path
from aeros.cli.bag import bagged
from aeros.cli.exit_codes import EXIT_CODES, Exit
from aeros.cli.goal import goal_of
from aeros.cli.interruptible import Interruptible
from aeros.cli.latest_run import note_run
from aeros.cli.notification import READY, STOPPING, Attended, Notifier
from aeros.cli.page.left import read_left
from aeros.cli.planners import LLM_KEY, planner_of, time_for
from aeros.cli.plants import (
    PLANTS,
    PlantRefusedError,
    bodies_of,
    faults_of,
    film_of,
    joined,
    open_plant,
    people_of,
    window_of,
)
from aeros.cli.premises import (
    REFUSALS,
    governed,
    isolated_skills,
    key_file_of,
    output_folder,
    seed_of,
    signing_with,
    task_meant,
)
from aeros.cli.report import written
from aeros.cli.run_report import TraceWriter, summary
from aeros.cli.unfinished import forget, keep, restore
from aeros.cli.watchdog import watch
from aeros.runtime.audit import AuditLog, AuditReport, verify_log
from aeros.runtime.audit_checkpoints import Signing, verify_signed
from aeros.runtime.bus.samples import FILE as SAMPLES
from aeros.runtime.bus.samples import Samples
from aeros.runtime.bus.watched_plant import WatchedPlant
from aeros.runtime.configuration import Configuration
from aeros.runtime.executor import Executor
from aeros.runtime.gate import Gate, GateMode
from aeros.runtime.governor import Command, Governor
from aeros.runtime.ports import Plant
from aeros.runtime.registry.governing import Steering
from aeros.runtime.registry.registry import Registry
from aeros.sim.hosting.host import Host, HostLog
from aeros.sim.hosting.remote import RemotePlant
from aeros.sim.hosting.wire import LostError
from aeros.spec.model import Clause
from aeros.spec.reports import Report

if TYPE_CHECKING:
    from aeros.sim.bodies import Body
    from aeros.sim.faults.injector import Happening
    from aeros.sim.faults.model import Fault
    from aeros.sim.people import Person
    from aeros.sim.physics import Spectator

    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_EXAMPLES = """\
All modules are proved before anything moves, and each `ecm.lock` must be the certificate that
results.  The folder given by --out holds afterwards: run.webp (physics), trace.jsonl (what the agent
did), measured.jsonl (what was measured, ten times a second), audit.jsonl (every decision, chained), and
with --report a page about all of it.  The exit code is 0 when the goal is measured, 1 when not.
A film, bag or MCAP file is whole or not there: after Ctrl-C, which stops the robot, it ends there.
A person walks their own way and minds nothing; the robot slows down or stops as the site says.
A composition is a graph of skills that the module declares; its branches run at the same time.
The planner smt needs no planning rules: it plans by what skills declare, for any goal (`aeros plan`).

examples:
  aeros run "make dumplings"
  aeros run "clean the table" --seed 7 --out runs/clean
  aeros run "make dumplings" --plant symbolic --gate shadow
  aeros run "fetch the object" --plant kinematic --seed 3
  aeros run "fetch the object" --composition fetch_once --timeout 60
  aeros run "make dumplings" --planner smt --plan-within 5
  aeros run "make dumplings" --planner pddl --engine pyperplan
  aeros run "make dumplings" --planner llm --llm-url http://localhost:11434/v1 --llm-model qwen3
  aeros run "make dumplings" --goal "dumpling_wrapped and not dumpling_cooked"
  aeros run "fetch the object" --person across_the_room
  aeros run "make dumplings" --faults wrapper_bumped --seed 4
  aeros run "make dumplings" --record dumplings.mp4 --mcap dumplings.mcap
  aeros run "make dumplings" --view --no-record
  aeros run "make dumplings" --person at_the_bench --report
  aeros run "fetch the object" --scene shelf_behind
  aeros run "make dumplings" --bag runs/demo-bag
  aeros run "make dumplings" --watchdog
  aeros run --resume
  aeros run "make dumplings" --audit-key .aeros/audit.key --anchor /mnt/other/demo.anchor
"""


_PATIENCE: Final = 30.0
"""Seconds for an earlier agent to end."""


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments."""
    parser = commands.add_parser(
        "run",
        description=__doc__,
        epilog=f"{_EXAMPLES}\n{EXIT_CODES}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("instruction", nargs="?", help='what to do, as in "make dumplings"')
    parser.add_argument("--seed", type=seed_of, default=0, help="of everything random (default: 0)")
    parser.add_argument("--plant", choices=PLANTS, default="physics", help="default: physics")
    parser.add_argument(
        "--gate",
        choices=[mode.value for mode in GateMode],
        default=GateMode.COMPILED.value,
        help="how conditions are decided; shadow does both and halts on a disagreement (default: compiled)",
    )
    parser.add_argument(
        "--site",
        type=existing_path,
        help="the site file (default: the policy in force on this robot, or else the reference site)",
    )
    parser.add_argument(
        "--ecms",
        type=existing_path,
        help="the modules to load (default: those that are active on this robot, or else `ecms`)",
    )
    parser.add_argument(
        "--out", type=Path, help="a new folder for film, trace and audit log (default: in runs/)"
    )
    parser.add_argument(
        "--state", type=Path, default=Path(".aeros"), help="the agent's own folder (default: .aeros)"
    )
    parser.add_argument(
        "--composition", metavar="NAME", help="follow this composition of the module, not its planning rules"
    )
    parser.add_argument(
        "--planner",
        choices=("rules", "smt", "pddl", "llm"),
        help="plan by the task's rules, by what skills declare with our own search or a classical planner's, "
        "or as a language model proposes (default: rules; smt with --goal)",
    )
    parser.add_argument(
        "--engine",
        metavar="NAME",
        help="the classical planner of --planner pddl, as unified-planning calls it (default: its choice)",
    )
    parser.add_argument(
        "--llm-url",
        metavar="URL",
        help=f"the OpenAI-compatible API to ask, as in http://localhost:11434/v1; its key in {LLM_KEY}",
    )
    parser.add_argument("--llm-model", metavar="NAME", help="the language model to ask there")
    parser.add_argument(
        "--goal", metavar="EXPR", help="reach this in place of the task's goal, where the task takes place"
    )
    parser.add_argument(
        "--plan-within",
        type=_seconds,
        metavar="SECONDS",
        help="what a planner that searches or asks may take for a plan, while the plant's time goes on "
        "(default, and at most: what the site allows)",
    )
    parser.add_argument(
        "--timeout",
        type=_seconds,
        metavar="SECONDS",
        help="cancel the task after this time on the plant's clock (default: only each skill has a time-out)",
    )
    kept = parser.add_mutually_exclusive_group()
    kept.add_argument(
        "--bag",
        type=Path,
        metavar="FOLDER",
        help="keep decisions, joints, transforms and what is measured as a ROS 2 bag in this new folder",
    )
    kept.add_argument(
        "--mcap", type=mcap_path, metavar="FILE", help="keep the same in this one new file, for Foxglove, say"
    )
    parser.add_argument(
        "--person",
        metavar="FILE|NAME",
        help="let somebody walk about (physics): a people file, or one that comes with AEROS",
    )
    parser.add_argument(
        "--faults",
        metavar="FILE|NAME",
        help="let things go wrong (physics): a faults file, or one that comes with AEROS",
    )
    parser.add_argument(
        "--scene",
        metavar="FILE|NAME",
        help="let more stand and lie about (physics): a scene file, or one that comes with AEROS",
    )
    parser.add_argument(
        "--report", action="store_true", help="write report.html there too, as `aeros report` does"
    )
    film = parser.add_mutually_exclusive_group()
    film.add_argument(
        "--record",
        type=film_path,
        metavar="FILE",
        help="the film to write (physics): *.webp, *.gif or *.mp4 (default: run.webp in the folder of --out)",
    )
    film.add_argument("--no-record", action="store_true", help="take no film")
    parser.add_argument(
        "--view", action="store_true", help="show the run in a window (physics), where there is a display"
    )
    parser.add_argument(
        "--audit-key",
        type=existing_path,
        metavar="FILE",
        help="sign the audit log with this key (default: audit.key in the agent's folder, if there is one)",
    )
    parser.add_argument(
        "--anchor", type=writable_path, metavar="FILE", help="keep the log's newest signature here as well"
    )
    surviving = parser.add_argument_group("survival", "docs/survival.md says what is held by what")
    surviving.add_argument(
        "--watchdog",
        action="store_true",
        help="let the plant outlive the agent, which is started anew where it crashes, and goes on",
    )
    surviving.add_argument(
        "--resume",
        action="store_true",
        help="go on with the task that a crash interrupted",
    )
    surviving.add_argument(
        "--crashes", type=_count, default=5, metavar="N", help="so many are a crash loop (default: 5) …"
    )
    surviving.add_argument(
        "--within", type=_seconds, default=600.0, metavar="SECONDS", help="… within this time (default: 600)"
    )
    surviving.add_argument(
        "--silence",
        type=_seconds,
        default=60.0,
        metavar="SECONDS",
        help="an agent without a sign of life for so long is killed (default: 60)",
    )
    surviving.add_argument("--serve-plant", action="store_true", help=argparse.SUPPRESS)
    parser.set_defaults(command=_command, plant_at=None)


def _count(text: str) -> int:
    if not text.isascii() or not text.isdigit() or not 0 < int(text) < 2**31:
        raise argparse.ArgumentTypeError("expected a whole number above 0")
    return int(text)


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
    if is_going_on != (arguments.instruction is None):
        raise UsageError("give an instruction, or --resume and none")
    try:
        if is_going_on:
            arguments = restore(arguments)
        if arguments.watchdog:
            return _watch(arguments)
        if not arguments.resume:
            return _pursue(arguments)
        # One process after the other, from the first to the last that it does: an agent whose watchdog was
        # killed may still be about to end.
        with exclusive(arguments.state / "task", arguments.instruction, _PATIENCE):
            return _pursue(arguments)
    except (RefusedError, PlantRefusedError) as refusal:
        print(f"aeros: {refusal}", file=sys.stderr)
        return Exit.REJECTED


def _watch(arguments: argparse.Namespace) -> Exit:
    """Have the task pursued by an agent under a watchdog, of which there is one."""
    if arguments.bag is not None or arguments.mcap is not None:
        raise UsageError("--bag and --mcap are written by one process: they do not go with --watchdog")
    with exclusive(arguments.state / "watchdog", arguments.instruction):
        quarantined = Quarantine(arguments.state).reason()
        if quarantined is not None:
            raise RefusedError(quarantined)
        if not arguments.resume:
            with exclusive(arguments.state, arguments.instruction):
                arguments.out = output_folder(arguments.out, "watched")
                arguments.plant_at = Path(tempfile.mkdtemp(prefix="aeros-")) / "plant.sock"
                # What an earlier task left is not this one's.
                Checkpoints(arguments.state).forget()
                # A stop ended an earlier run; from here on it is meant for this one.
                Steering(Registry(arguments.state).folder, resumed=False).close()
                keep(arguments)
        return watch(arguments)


def _pursue(arguments: argparse.Namespace) -> Exit:
    key_file = key_file_of(arguments)
    governor, configuration, report = governed(arguments, resumed=arguments.resume or arguments.serve_plant)
    try:
        signing = signing_with(key_file, arguments.anchor)
        people = people_of(arguments.plant, arguments.person)
        routed = task_meant(arguments.instruction, configuration, governor, arguments.state)
        goal = None if arguments.goal is None else goal_of(arguments.goal, configuration.site)
        planner = planner_of(arguments, configuration.modules[routed.module], configuration.site)
        around = _Around((), (), ())
        if arguments.plant_at is None or arguments.serve_plant:
            faults = faults_of(arguments.plant, arguments.faults, configuration, routed.task)
            bodies = bodies_of(arguments.plant, arguments.scene, routed.task, arguments.seed)
            around = _Around(people, faults, bodies)
        with _watched(arguments, routed.task.id) as (out, spectators), governor:
            if arguments.serve_plant:
                return _serve(arguments, configuration, routed, around, spectators, out)
            return _run(
                arguments,
                configuration,
                governor,
                report,
                routed,
                planner,
                goal,
                around,
                spectators,
                out,
                signing,
            )
    except REFUSALS as refusal:
        print(f"aeros: {refusal}", file=sys.stderr)
        return Exit.REJECTED
    except LostError as lost:
        # Whoever supervises this process may try it again.
        print(f"aeros: the plant is lost: {lost}", file=sys.stderr)
        return Exit.OUR_BUG


@contextmanager
def _watched(arguments: argparse.Namespace, task: str) -> Iterator[tuple[Path, Sequence[Spectator]]]:
    """The folder for what is left of the run, and who looks on: both are there before anything moves."""
    with ExitStack() as closing:
        spectators: list[Spectator] = []
        if arguments.plant_at is not None and not arguments.serve_plant:
            yield arguments.out, spectators
            return
        if arguments.view:
            spectators.append(window_of(arguments.plant))
            closing.callback(spectators[0].close)
        out = arguments.out if arguments.serve_plant else output_folder(arguments.out, task)
        is_filmed = arguments.plant == "physics" and not arguments.no_record
        if is_filmed or arguments.record is not None:
            spectators.append(film_of(arguments.plant, arguments.record or out / "run.webp"))
        yield out, spectators


class _Around(NamedTuple):
    """What is in a simulated scene besides the task's own things, and what goes wrong there."""

    people: Sequence[Person]
    faults: Sequence[Fault]
    bodies: Sequence[Body]


def _serve(
    arguments: argparse.Namespace,
    configuration: Configuration,
    routed: Routed,
    around: _Around,
    spectators: Sequence[Spectator],
    out: Path,
) -> Exit:
    """Be the plant of a run whose agent is another process; nothing, where there is one already."""
    tell = HostLog(out / "plant.jsonl")
    with (
        suppress(RefusedError),
        exclusive(arguments.state / "plant", arguments.instruction),
        _plant(
            arguments, configuration, routed, around, spectators, lambda one: tell(one._asdict())
        ) as plant,
    ):
        Host(plant, tell).serve(arguments.plant_at)
        with suppress(OSError):
            arguments.plant_at.parent.rmdir()
    return Exit.PROVED


def _plant(
    arguments: argparse.Namespace,
    configuration: Configuration,
    routed: Routed,
    around: _Around,
    spectators: Sequence[Spectator],
    tell: Callable[[Happening], None],
) -> AbstractContextManager[Plant]:
    """The plant of this process, or of another that is served at `plant_at`."""
    if arguments.plant_at is not None and not arguments.serve_plant:
        return closing(joined(arguments.plant_at))
    people, faults, bodies = around
    plant, seed = arguments.plant, arguments.seed
    return open_plant(plant, configuration, routed.task, seed, spectators, people, faults, tell, bodies)


def _run(
    arguments: argparse.Namespace,
    configuration: Configuration,
    governor: Governor,
    proof: Report,
    routed: Routed,
    planner: Planner,
    goal: Clause | None,
    around: _Around,
    spectators: Sequence[Spectator],
    out: Path,
    signing: Signing | None,
) -> Exit:
    audit_path = out / "audit.jsonl"
    durability = configuration.site.durability
    began = time.perf_counter()
    with (
        isolated_skills(configuration) as skills,
        bagged(arguments.bag, arguments.mcap, configuration.site) as feed,
        AuditLog(
            audit_path, durability=durability, signing=signing, listener=None if feed is None else feed.record
        ) as audit,
        TraceWriter(out / "trace.jsonl") as trace,
        Samples(out / SAMPLES, configuration.site) as samples,
        Notifier() as notifier,
        _plant(
            arguments,
            configuration,
            routed,
            around,
            spectators,
            lambda one: trace.tell(
                Event(one.event, one.text, {"fault": one.fault, "opportunity": one.opportunity}, one.time)
            ),
        ) as opened,
    ):
        sampled = WatchedPlant(opened, samples)
        plant = sampled if feed is None else WatchedPlant(sampled, feed)
        gate = Gate(configuration, GateMode(arguments.gate))
        with (
            Interruptible(governor) as governed,
            Executor(
                configuration,
                gate,
                plant,
                audit,
                skills,
                attended := Attended(governed, notifier),
                resumed=arguments.resume,
            ) as executor,
        ):
            audit.append("isolation", skills.details())
            with awake(
                arguments.state,
                configuration.site.id,
                executor,
                planner,
                trace.tell,
                arguments.seed,
                within=time_for(arguments, planner),
                purpose=arguments.instruction,
            ) as agent:
                note_run(arguments.state, out)
                attended.on_command = partial(_heed, agent)
                notifier.tell(READY)
                pursue = agent.resume if arguments.resume else agent.run
                try:
                    report = pursue(arguments.instruction, arguments.timeout, goal)
                except EndedError:
                    _end(opened, arguments.state)
                    raise
            notifier.tell(STOPPING)
        simulated = plant.now()
        if not notifier.is_alone:
            _end(opened, arguments.state)
    print(summary(proof, report, arguments.plant, simulated, time.perf_counter() - began))
    audited, sound = _audited(audit_path, signing)
    print(f"audit      {audited.records} records, {sound}")
    if not report.reached:
        print(f"why        aeros why {out}")
    if arguments.record is not None and arguments.record.exists():
        print(f"film       {arguments.record}")
    if feed is not None:
        kept = f"bag        {arguments.bag}/" if arguments.mcap is None else f"mcap       {arguments.mcap}"
        print(kept + (f", {feed.lost} not kept: {feed.trouble}" if feed.lost else ""))
    if arguments.report:
        site = configuration.site
        written(read_left(out), out / "report.html", {site.digest: site}, sound)
    print(f"left in    {out}/: " + ", ".join(sorted(path.name for path in out.iterdir())))
    if governed.is_interrupted:
        return Exit.INTERRUPTED
    return Exit.PROVED if report.reached and audited.bad_record is None else Exit.REJECTED


def _end(plant: Plant, state: Path) -> None:
    """Let a plant that outlives this process end with the task, which is not to be resumed."""
    if isinstance(plant, RemotePlant):
        forget(state)
        plant.end()


def _heed(agent: Agent, command: Command) -> None:
    agent.heed(is_paused=command is Command.PAUSE)


def _audited(log: Path, signing: Signing | None) -> tuple[AuditReport, str]:
    """What a look at the finished log finds, and in words."""
    if signing is None:
        chain, sound = verify_log(log), "chain sound"
    else:
        chain = verify_signed(log, signing.key.public, signing.anchor).chain
        sound = "chain sound, signed" if signing.anchor is None else "chain sound, signed and anchored"
    return chain, sound if chain.sound else f"record {chain.bad_record}: {chain.why}"
