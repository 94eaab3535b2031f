"""Kills agents, workers and watchdogs at random instants: `python -m benchmarks.survival --trials 200`.

Each trial is one task under `aeros run --watchdog`, on a plant and with a state folder of its own.  At random
instants kill -9 hits the agent, one of the processes that its skills run in, or the watchdog, which is then
started again, as an init system would.  What is checked comes from the plant's own log and from the audit
log as it was at each kill, and not from what the agent says of itself:

- ended: the task ends;
- once: no skill begins on the plant while a success that it had before is measured still, but for what
  the task's rules run between two tries, after a step that has ended in failure;
- kept: what the audit log held at a kill is the beginning of what it holds at the end, in one sound chain;
- stopped: whenever an agent let go of the plant, that came to rest, and nothing moved until the next came.
"""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from math import dist
from pathlib import Path
from typing import Any, Final

from aeros.runtime.audit import verify_log
from aeros.spec.diagnostics import Diagnostics
from aeros.spec.folders import reference_site
from aeros.spec.loading import load_ecm, load_site
from aeros.spec.model import Ecm
from benchmarks.command import parser_of, print_json

_ROOT: Final = Path(__file__).parents[1]
_TASK: Final = "make dumplings"
_LATEST: Final = 600.0
"""Real seconds after which a task has not ended."""

_AT_REST: Final = {"symbolic": 0.0, "kinematic": 0.0, "physics": 0.02}
"""Joint speed, rad/s, below which an arm is at rest: physics holds it with motors against gravity."""

_STILL: Final = {"symbolic": 0.0, "kinematic": 0.0, "physics": 1e-9}
"""How far a joint may have moved while nobody was there, rad."""

VICTIMS: Final = ("agent", "worker", "watchdog")


@dataclass
class Trial:
    """What came of one task.

    kills: who was killed, in order.
    recovered: how often an agent found that its last session had ended without a word.
    resumed: how often one went on with a plan, or made another, where it was.
    amid_motion: how often the plant was moving when its agent let go.
    missed: why the goal was not reached.
    broken: what must not be and is; empty where all is as it should be.
    """

    seed: int
    kills: list[str] = field(default_factory=list)
    reached: bool = False
    missed: str = ""
    recovered: int = 0
    resumed: int = 0
    amid_motion: int = 0
    seconds: float = 0.0
    broken: list[str] = field(default_factory=list)


class _Life:
    """A task under way, and what harms it."""

    def __init__(self, trial: Trial, plant: str, folder: Path) -> None:
        self._trial = trial
        self._folder = folder
        self._said = (folder / "said").open("ab")
        self.state, self.out = folder / "state", folder / "out"
        self.log = self.out / "audit.jsonl"
        options = ("--plant", plant, "--seed", str(trial.seed), "--no-record", "--out", str(self.out))
        self._asked = (_TASK, *options)
        self._watchdog = self._start(*self._asked)
        self._seen: list[bytes] = []

    def _start(self, *arguments: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "aeros", "run", *arguments, "--watchdog"]
        more = ("--state", str(self.state), "--crashes", "1000")
        return subprocess.Popen([*command, *more], cwd=_ROOT, stdout=self._said, stderr=self._said)

    def kill(self, victim: str) -> bool:
        """Kill it, if it is there to be killed."""
        agent = self._agent()
        pids = {"agent": [agent], "watchdog": [self._watchdog.pid], "worker": _below(agent)}[victim]
        pids = [pid for pid in pids if pid > 0]
        if not pids or self._watchdog.poll() is not None:
            return False
        self._keep()
        with suppress(ProcessLookupError):
            os.kill(random.choice(pids), signal.SIGKILL)  # noqa: S311
        self._trial.kills.append(victim)
        if victim == "watchdog":
            self._watchdog.wait()
            # What it had not taken note of was not asked for yet.
            is_known = (self.state / "run.json").exists()
            self._watchdog = self._start(*(("--resume",) if is_known else self._asked))
        return True

    def is_awake(self) -> bool:
        return self._agent() > 0

    def has_ended(self) -> bool:
        return self._watchdog.poll() is not None

    def end(self) -> None:
        """Wait for the task to end, for as long as it may take."""
        with suppress(subprocess.TimeoutExpired):
            self._watchdog.wait(_LATEST)
        if self._watchdog.poll() is None:
            self._trial.broken.append(f"ended: not after {_LATEST:g} s")
            for pid in (self._watchdog.pid, self._agent()):
                with suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
            self._watchdog.wait()
        self._said.close()

    def unkept(self) -> list[str]:
        """Where the log has lost what it held at a kill."""
        held = self.log.read_bytes() if self.log.exists() else b""
        return [
            "kept: records that were there at a kill are not"
            for one in self._seen
            if not held.startswith(one)
        ]

    def _keep(self) -> None:
        held = self.log.read_bytes() if self.log.exists() else b""
        self._seen.append(held[: held.rfind(b"\n") + 1])

    def _agent(self) -> int:
        """The process that holds the agent's folder, 0 where there is none."""
        try:
            pid = int(json.loads((self.state / "agent.lock").read_text())["pid"])
        except (OSError, ValueError, KeyError):
            return 0
        # The watchdog holds it for a moment itself.
        return pid if pid != self._watchdog.pid and Path(f"/proc/{pid}").exists() else 0


def _below(pid: int) -> list[int]:
    """The processes that it started, and that those did."""
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


def trial_of(seed: int, plant: str, modules: Mapping[str, Ecm], lasting: float) -> Trial:
    """One task, killed at up to three instants within `lasting` seconds of its agent's awakening."""
    trial = Trial(seed)
    chance = random.Random(seed)  # noqa: S311
    began = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="survival-") as name:
        life = _Life(trial, plant, Path(name))
        for _ in range(chance.randint(1, 3)):
            # One in four while processes are still starting, the others while the task is under way.
            if chance.random() < 0.25:
                time.sleep(chance.uniform(0.0, 2.0))
            else:
                _wait_for(life)
                time.sleep(chance.uniform(0.0, lasting))
            life.kill(chance.choice(VICTIMS))
        life.end()
        trial.seconds = time.monotonic() - began
        _judge(trial, life, plant, modules)
        if trial.broken:
            trial.broken.append((Path(name) / "said").read_text(errors="replace")[-3000:])
    return trial


def lasts(plant: str) -> float:
    """Seconds from when an undisturbed agent is awake to when it is not: kills that come later hit nobody."""
    with tempfile.TemporaryDirectory(prefix="survival-") as name:
        life = _Life(Trial(0), plant, Path(name))
        _wait_for(life)
        began = time.monotonic()
        while life.is_awake():
            time.sleep(0.01)
        ended = time.monotonic()
        life.end()
        return ended - began


def _wait_for(life: _Life) -> None:
    latest = time.monotonic() + 60.0
    while not life.is_awake() and not life.has_ended() and time.monotonic() < latest:
        time.sleep(0.01)


def _judge(trial: Trial, life: _Life, plant: str, modules: Mapping[str, Ecm]) -> None:
    notes = [one["details"] for one in _lines(life.log) if one["event"] == "note"]
    ended = [one["details"] for one in notes if one["event"] == "run-ended"]
    trial.reached = any(one["reached"] for one in ended)
    trial.missed = "" if trial.reached or not ended else ended[-1]["reason"]
    changes = [one["details"]["change"] for one in notes if one["event"] == "lifecycle"]
    trial.recovered = changes.count("crash")
    trial.resumed = sum(one["event"] == "resumed" for one in notes)
    if not ended:
        trial.broken.append("ended: no record says so")
    if (life.state / "run.json").exists():
        trial.broken.append("ended: the state folder says that there is something to resume")
    chain = verify_log(life.log)
    if not chain.sound:
        trial.broken.append(f"kept: record {chain.bad_record}: {chain.why}")
    trial.broken += life.unkept()
    told = _lines(life.out / "plant.jsonl")
    trial.amid_motion = sum(one["event"] == "let-go" and one["amid_motion"] for one in told)
    trial.broken += [*_repeated(told, modules), *_moved(told, plant)]


def _repeated(told: Iterable[Mapping[str, Any]], modules: Mapping[str, Ecm]) -> list[str]:
    """Skills that began while what they had brought about before was measured still."""
    broken: list[str] = []
    achieved: dict[str, list[Mapping[str, Any]]] = {}
    helpers = {
        f"{ecm.id}.{rule.on_failure}"
        for ecm in modules.values()
        for task in ecm.tasks.values()
        for rule in task.rules
    }
    for one in told:
        if one["event"] == "skill-began":
            still = [was for was in achieved.get(one["skill"], ()) if _holds(was, one["measured"])]
            broken += [f"once: {one['skill']} at {one['time']:.2f} s, though {dict(was)}" for was in still]
        elif one["event"] == "skill-ended":
            module, name = one["skill"].split(".")
            successes = modules[module].skills[name].success_outcomes if one["finished"] else ()
            found = [each.effects for each in successes if _holds(each.effects, one["measured"])]
            achieved.setdefault(one["skill"], []).extend(found)
            if not found:
                for helper in helpers:
                    achieved.pop(helper, None)
    return broken


def _holds(effects: Mapping[str, Any], measured: Mapping[str, Any]) -> bool:
    return bool(effects) and all(measured.get(name) == value for name, value in effects.items())


def _moved(told: Sequence[Mapping[str, Any]], plant: str) -> list[str]:
    """Where the plant was not at rest once its agent was gone, or moved before the next came."""
    broken: list[str] = []
    for one, then in zip(told, [*told[1:], None], strict=False):
        if one["event"] != "let-go":
            continue
        speed = max(map(abs, one["measured"]["joint_velocity"]))
        if speed > _AT_REST[plant]:
            broken.append(f"stopped: at {one['time']:.2f} s a joint moved at {speed:.4f} rad/s")
        if then is None:
            continue
        if then["event"] != "connected" or then["time"] != one["time"]:
            broken.append(f"stopped: after {one['time']:.2f} s time went on without an agent")
        way = dist(one["measured"]["joint_position"], then["measured"]["joint_position"])
        if way > _STILL[plant]:
            broken.append(f"stopped: a joint moved by {way:g} rad without an agent")
    return broken


def _lines(path: Path) -> list[dict[str, Any]]:
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_bytes().splitlines() if line.endswith(b"}")]


def modules() -> dict[str, Ecm]:
    """The modules of the task, with what their skills declare."""
    site = load_site(reference_site(), Diagnostics())
    assert site is not None  # noqa: S101  the reference site is proved by the tests
    loaded = load_ecm(_ROOT / "ecms" / "make_dumplings", site, Diagnostics())
    assert loaded is not None  # noqa: S101
    return {loaded.ecm.id: loaded.ecm}


def main() -> None:
    """Run the trials and say what came of them."""
    parser = parser_of(__doc__, "two trials")
    parser.add_argument("--trials", type=int, default=200)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--plant", choices=tuple(_AT_REST), default="symbolic")
    parser.add_argument("--lasting", type=float, help="seconds in which kills fall (default: measured)")
    arguments = parser.parse_args()
    trials = 2 if arguments.quick else arguments.trials
    lasting = arguments.lasting or lasts(arguments.plant)
    known = modules()
    each: list[Trial] = []
    for seed in range(arguments.first, arguments.first + trials):
        each.append(trial_of(seed, arguments.plant, known, lasting))
        if arguments.format == "text":
            told = each[-1].broken or (
                "goal reached" if each[-1].reached else f"goal not reached: {each[-1].missed}"
            )
            print(f"seed {seed}: {', '.join(each[-1].kills) or 'nobody'} killed; {told}", flush=True)
    kills = Counter(victim for one in each for victim in one.kills)
    found = {
        "plant": arguments.plant,
        "trials": trials,
        "kills": {victim: kills[victim] for victim in VICTIMS},
        "recovered": sum(one.recovered for one in each),
        "resumed": sum(one.resumed for one in each),
        "amid_motion": sum(one.amid_motion for one in each),
        "reached": sum(one.reached for one in each),
        "broken": sum(bool(one.broken) for one in each),
    }
    if arguments.format == "json":
        print_json({**found, "each": [asdict(one) for one in each]})
        return
    for name, value in found.items():
        print(f"{name:12} {value}")


if __name__ == "__main__":
    main()
