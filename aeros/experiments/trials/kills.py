"""Trials of kill -9: one task under its watchdog, of which processes are killed at random instants.

Each trial is one task under `aeros run --watchdog`, on a plant and with a state folder of its own.  At random
instants kill -9 hits the agent, one of the processes that its skills run in, or the watchdog, which is then
started again, as an init system would do.  The checks read the plant's own log and the audit log as it was at
each kill, not the agent's report of itself:

- ended: the task ends;
- once: no skill begins on the plant while the effects of its earlier success are still measured, except
  skills that the task's rules run between two tries, after a step that has ended in failure;
- kept: what the audit log held at a kill is the beginning of what it holds at the end, in one sound chain;
- stopped: whenever an agent let go of the plant, the plant came to rest, and did not move until the next
came.

Settings of a condition: `instruction`; `victims`, what may be killed; `on`, the plant.  Processes are real
and so are the instants: a seed draws them, and what they hit depends on how busy the machine is.
"""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import cache
from math import inf
from pathlib import Path
from typing import Any, Final

import aeros
from aeros.experiments.condition import TrialCondition
from aeros.experiments.inputs import InputPaths, TrialInputs
from aeros.experiments.trial_kinds import SCRATCH_ROOT, Findings
from aeros.experiments.trial_kinds import Trial as Tried
from aeros.experiments.trials.kill_logs import motion_without_agent, read_whole_lines, repeated_skills
from aeros.files import temporary_folder
from aeros.runtime.audit.log import verify_log
from aeros.spec.migrations.renamed_names import current_event
from aeros.spec.model.ecm import Ecm

LONGEST_TASK: Final = 600.0
"""Real seconds from the last kill after which a task counts as endless."""

_SHUTDOWN_S: Final = 2.0
"""Real seconds that a plant has to end by itself once its task has ended."""

VICTIMS: Final = ("agent", "worker", "watchdog")

_POLL_INTERVAL_S: Final = 0.005
"""Seconds between two reads of the plant's log."""


@dataclass
class KillTrial:
    """Result of one task.

    Attributes:
        seed: of the trial.
        kills: killed processes, in order.
        reached: True if the goal was reached.
        failure_reason: reason why the goal was not reached.
        recovered: times that an agent found that its last session had ended without a record.
        resumed: times that an agent went on with a plan, or made another, where its predecessor had stopped.
        kills_in_motion: times that the plant was moving when its agent let go.
        seconds: real time of the trial, s.
        stop_times_s: from a kill to when the agent had let go and the plant was at rest, s, where it was.
        resume_times_s: from then to the next skill that began, s.
        violations: checks that failed; empty where all is well.
    """

    seed: int
    kills: list[str] = field(default_factory=list)
    reached: bool = False
    failure_reason: str = ""
    recovered: int = 0
    resumed: int = 0
    kills_in_motion: int = 0
    seconds: float = 0.0
    stop_times_s: list[float] = field(default_factory=list)
    resume_times_s: list[float] = field(default_factory=list)
    violations: list[str] = field(default_factory=list)


class _SupervisedTask:
    """A task that runs under its watchdog, and what is done to it."""

    def __init__(
        self,
        trial: KillTrial,
        plant: str,
        folder: Path,
        where: InputPaths,
        instruction: str,
        longest: float = LONGEST_TASK,
    ) -> None:
        self._longest = longest
        self._trial = trial
        self._output = (folder / "said").open("ab")
        self.state, self.out = folder / "state", folder / "out"
        self.log = self.out / "audit.jsonl"
        site = () if where.site is None else ("--site", str(Path(where.site).resolve()))
        options = ("--plant", plant, "--seed", str(trial.seed), "--no-film", "--out", str(self.out), *site)
        self._asked = (instruction, *options, "--ecms", str(Path(where.modules_folder).resolve()))
        self._watchdog = self._start(*self._asked)
        self._seen: list[bytes] = []
        self.stamps = PlantLogTimes(self.out / "plant.jsonl")
        self._killed: list[float] = []

    def _start(self, *arguments: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "aeros", "run", *arguments, "--watchdog"]
        more = ("--state", str(self.state), "--max-crashes", "1000")
        # The child imports the same AEROS as this process.
        paths = [str(Path(aeros.__file__).parents[1]), os.environ.get("PYTHONPATH", "")]
        return subprocess.Popen(  # noqa: S603
            [*command, *more],
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))},
            stdout=self._output,
            stderr=self._output,
        )

    def kill(self, victim: str) -> bool:
        """Kill the victim; return false where it is not there to be killed."""
        agent = self._agent_pid()
        pids = {"agent": [agent], "watchdog": [self._watchdog.pid], "worker": _descendants(agent)}[victim]
        pids = [pid for pid in pids if pid > 0]
        if not pids or self._watchdog.poll() is not None:
            return False
        self._snapshot_log()
        with suppress(ProcessLookupError):
            os.kill(random.choice(pids), signal.SIGKILL)  # noqa: S311
        self._trial.kills.append(victim)
        self._killed.append(time.monotonic())
        if victim == "watchdog":
            self._watchdog.wait()
            # A run that it has not recorded yet is requested again.
            is_known = (self.state / "run.json").exists()
            self._watchdog = self._start(*(("--resume",) if is_known else self._asked))
        return True

    def is_awake(self) -> bool:
        return self._agent_pid() > 0

    def has_ended(self) -> bool:
        return self._watchdog.poll() is not None

    def end(self) -> None:
        """Wait for the task to end, for as long as it may take."""
        with suppress(subprocess.TimeoutExpired):
            self._watchdog.wait(self._longest)
        if self._watchdog.poll() is None:
            self._trial.violations.append(f"ended: not after {self._longest:g} s")
            for pid in (self._watchdog.pid, self._agent_pid()):
                # 0 stands for none; kill would send the signal to all processes of our group.
                if pid > 0:
                    with suppress(ProcessLookupError):
                        os.kill(pid, signal.SIGKILL)
            self._watchdog.wait()
        self._end_plant_host()
        self._output.close()
        self.stamps.end()
        self._trial.stop_times_s, self._trial.resume_times_s = self.stamps.stop_and_resume_times(self._killed)

    def _end_plant_host(self) -> None:
        """End a plant that an agent killed in its last moments has left behind: nobody will come for it."""
        latest = time.monotonic() + _SHUTDOWN_S
        while (host := _holder_of(self.state / "plant")) > 0:
            if time.monotonic() > latest:
                with suppress(ProcessLookupError):
                    os.kill(host, signal.SIGKILL)
                return
            time.sleep(_POLL_INTERVAL_S)

    def lost_records(self) -> list[str]:
        """List losses: records that the log held at a kill and does not hold any more."""
        held = self.log.read_bytes() if self.log.exists() else b""
        return [
            "kept: records that were there at a kill are not"
            for one in self._seen
            if not held.startswith(one)
        ]

    def _snapshot_log(self) -> None:
        held = self.log.read_bytes() if self.log.exists() else b""
        self._seen.append(held[: held.rfind(b"\n") + 1])

    def _agent_pid(self) -> int:
        """Return the id of the process that holds the agent's folder, 0 where there is none."""
        pid = _holder_of(self.state)
        # The watchdog itself holds it briefly.
        return pid if pid != self._watchdog.pid else 0


def _holder_of(folder: Path) -> int:
    """Return the id of the living process that holds `folder`, 0 where there is none."""
    try:
        pid = int(json.loads((folder / "agent.lock").read_text())["pid"])
    except (OSError, ValueError, KeyError):
        return 0
    return pid if Path(f"/proc/{pid}").exists() else 0


class PlantLogTimes:
    """Times of this machine's clock at which the lines of a plant's log were there.

    Args:
        path: of the log, which a thread follows.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._lines: list[tuple[float, str]] = []
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._follow, daemon=True)
        self._thread.start()

    def end(self) -> None:
        """Stop following the log."""
        self._is_over.set()
        self._thread.join()

    def stop_and_resume_times(self, killed: Sequence[float]) -> tuple[list[float], list[float]]:
        """Measure the time from each kill to rest, and from there to the next skill.

        Counts what came before the next kill.  Where no agent let go, the skill is counted from the kill.

        Args:
            killed: `time.monotonic()` of each kill, s, in order.

        Returns:
            Times to stop and times to resume, s.
        """
        stops, resumes = [], []
        for kill, following in zip(killed, [*killed, inf][1:], strict=True):
            after = [(at - kill, event) for at, event in self._lines if kill <= at < following]
            stop = next((at for at, event in after if event == "agent-disconnected"), None)
            resumed = (at for at, event in after if event == "skill-began" and (stop is None or at >= stop))
            resumes.append(next(resumed, None))
            stops.append(stop)
        return [one for one in stops if one is not None], [one for one in resumes if one is not None]

    def _follow(self) -> None:
        read = 0
        while not self._is_over.wait(_POLL_INTERVAL_S):
            with suppress(OSError), self._path.open("rb") as log:
                log.seek(read)
                new = log.read()
                whole = new[: new.rfind(b"\n") + 1]
                read += len(whole)
                now = time.monotonic()
                self._lines += [(now, str(json.loads(line)["event"])) for line in whole.splitlines()]


def _descendants(pid: int) -> list[int]:
    """List the processes that it started, and those that they started."""
    found: list[int] = []
    pending = [pid] if pid > 0 else []
    while pending:
        one = pending.pop()
        try:
            children = Path(f"/proc/{one}/task/{one}/children").read_text().split()
        except OSError:
            continue
        found += map(int, children)
        pending += map(int, children)
    return found


def trial_of(
    seed: int,
    plant: str,
    modules: Mapping[str, Ecm],
    duration_s: float,
    where: InputPaths,
    instruction: str,
    victims: Sequence[str] = VICTIMS,
    longest: float = LONGEST_TASK,
) -> KillTrial:
    """Run one task, killed at up to three instants within `duration_s` of its agent's awakening.

    Args:
        seed: draws instants and victims.
        plant: name of the plant.
        modules: the installed modules, by id.
        duration_s: seconds from the agent's awakening within which kills fall.
        where: site and modules of the run.
        instruction: the task.
        victims: processes that may be killed.
        longest: real seconds after the last kill by which the task must have ended.

    Returns:
        The result, with its violations.
    """
    trial = KillTrial(seed)
    chance = random.Random(seed)  # noqa: S311
    began = time.monotonic()
    with temporary_folder(SCRATCH_ROOT) as folder:
        life = _SupervisedTask(trial, plant, folder, where, instruction, longest)
        for _ in range(chance.randint(1, 3)):
            # One in four while processes are still starting, the others while the task is under way.
            if chance.random() < 0.25:
                time.sleep(chance.uniform(0.0, 2.0))
            else:
                _wait_for(life)
                time.sleep(chance.uniform(0.0, duration_s))
            life.kill(chance.choice(victims))
        life.end()
        trial.seconds = time.monotonic() - began
        _judge(trial, life, plant, modules)
        if trial.violations:
            trial.violations.append((folder / "said").read_text(errors="replace")[-3000:])
    return trial


@cache
def measure_duration(plant: str, where: InputPaths, instruction: str) -> float:
    """Measure the time that an undisturbed agent is awake: later kills would hit nothing.

    Args:
        plant: name of the plant.
        where: site and modules of the run.
        instruction: the task.

    Returns:
        Real seconds; cached.
    """
    with temporary_folder(SCRATCH_ROOT) as folder:
        life = _SupervisedTask(KillTrial(0), plant, folder, where, instruction)
        _wait_for(life)
        began = time.monotonic()
        while life.is_awake():
            time.sleep(0.01)
        ended = time.monotonic()
        life.end()
        return ended - began


def _wait_for(life: _SupervisedTask) -> None:
    latest = time.monotonic() + 60.0
    while not life.is_awake() and not life.has_ended() and time.monotonic() < latest:
        time.sleep(0.01)


def _judge(trial: KillTrial, life: _SupervisedTask, plant: str, modules: Mapping[str, Ecm]) -> None:
    notes = [one["details"] for one in read_whole_lines(life.log) if one["event"] == "note"]
    ended = [one["details"] for one in notes if one["event"] == "run-ended"]
    trial.reached = any(one["reached"] for one in ended)
    trial.failure_reason = "" if trial.reached or not ended else ended[-1]["reason"]
    changes = [one["details"]["change"] for one in notes if one["event"] == "lifecycle"]
    trial.recovered = changes.count("crash")
    trial.resumed = sum(current_event(one["event"]) == "run-resumed" for one in notes)
    if not ended:
        trial.violations.append("ended: no record says so")
    if (life.state / "run.json").exists():
        trial.violations.append("ended: the state folder says that there is something to resume")
    chain = verify_log(life.log)
    if not chain.is_sound:
        trial.violations.append(f"kept: record {chain.bad_record}: {chain.reason}")
    trial.violations += life.lost_records()
    plant_log = [
        {**line, "event": current_event(line["event"])} for line in read_whole_lines(life.out / "plant.jsonl")
    ]
    trial.kills_in_motion = sum(
        one["event"] == "agent-disconnected" and one["amid_motion"] for one in plant_log
    )
    trial.violations += [*repeated_skills(plant_log, modules), *motion_without_agent(plant_log, plant)]


class KillTrials:
    """Kind of trials in which processes of a running task are killed."""

    @contextmanager
    def open(self, condition: TrialCondition, premises: TrialInputs) -> Iterator[Tried]:
        """Implement `TrialKind.open`.

        An undisturbed run measures once for a process how long the task takes.
        """
        settings = condition.settings
        plant, instruction = settings["on"], settings["instruction"]
        modules = premises.configuration.modules
        lasting = measure_duration(plant, premises.paths, instruction)

        def trial(seed: int) -> Findings:
            began = time.process_time()
            one = trial_of(seed, plant, modules, lasting, premises.paths, instruction, settings["victims"])
            return {**findings_of(one), "processor_s": time.process_time() - began}

        yield trial

    def expected_values(self, condition: TrialCondition, premises: TrialInputs) -> Mapping[str, float] | str:
        """Implement `TrialKind.expected_values`.

        What docs/survival.md promises of every kill, which is not that the goal is reached.
        """
        return {"ended": 1.0, "repeated": 0.0, "lost": 0.0, "moved": 0.0}


def findings_of(one: KillTrial) -> dict[str, Any]:
    """Collect the findings of a trial.

    Args:
        one: the result of the trial.

    Returns:
        JSON values by name; times are means over the kills of the trial.
    """
    broken = [text.partition(":")[0] for text in one.violations]
    found = {
        "reached": one.reached,
        "reason": one.failure_reason,
        "kills": len(one.kills),
        "killed": one.kills,
        "ended": "ended" not in broken,
        "repeated": broken.count("once"),
        "lost": broken.count("kept"),
        "moved": "stopped" in broken,
        "recovered": one.recovered,
        "resumed": one.resumed,
        "amid_motion": one.kills_in_motion,
        "broken": one.violations,
        "seconds": one.seconds,
    }
    for name, times in (("to_stop_s", one.stop_times_s), ("to_resume_s", one.resume_times_s)):
        if times:
            found[name] = sum(times) / len(times)
    return found


KIND: Final = KillTrials()
