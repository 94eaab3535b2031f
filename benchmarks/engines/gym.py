"""Measure steps a second of the environments of Gymnasium: `python -m benchmarks.engines.gym`.

In `requests`, a step is one action: the tool moves to a random point in a box of 10 cm, the gate decides the
whole motion, and the episode's plant executes it.  In `skills`, a step is a whole skill, as of the rules of
`make_dumplings`.  Both are measured with the compiled gate, the site's sensors and isolated skills.

With `--panda-gym PYTHON`, an interpreter of another environment that has panda-gym, random actions of
`PandaReach-v3` and `PandaPickAndPlace-v3` are measured, too: a step there is 40 ms of PyBullet, with neither
sensors nor decisions.  The column of simulated seconds is what compares.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import gymnasium
import numpy as np

import aeros.gym
from benchmarks.command import build_parser, print_json

_ROOT: Final = Path(__file__).parents[2]

_BOUNDS: Final = {
    "move_tool.target": ((0.45, -0.05, 0.35), (0.55, 0.05, 0.45)),
    "move_tool.yaw": (0.0, 0.0),
    "move_tool.speed": (0.25, 0.25),
}

_SKILLS: Final = ("prepare", "wrap", "boil")

_FOREIGN: Final = """
import json, sys, time
import gymnasium, panda_gym
found = []
for name in ("PandaReach-v3", "PandaPickAndPlace-v3"):
    env = gymnasium.make(name)
    env.reset(seed=0)
    env.action_space.seed(0)
    steps, wall, cpu = 0, time.perf_counter(), time.process_time()
    while time.process_time() - cpu < float(sys.argv[1]):
        *_, ended, cut, info = env.step(env.action_space.sample())
        if ended or cut:
            env.reset()
        steps += 1
    found.append({"environment": name, "plant": "PyBullet", "steps": steps, "simulated": 0.04 * steps,
                  "cpu": time.process_time() - cpu, "wall": time.perf_counter() - wall})
print(json.dumps(found))
"""


@dataclass(frozen=True)
class StepRate:
    """Steps of one environment.

    Attributes:
        environment: what a step is.
        plant: the plant.
        steps: number of steps.
        simulated: their time on the plant's clock, s.
        cpu: processor time of this process, s; skills run in others.
        wall: time by the clock, s.
    """

    environment: str
    plant: str
    steps: int
    simulated: float
    cpu: float
    wall: float


def measure_requests(plant: str, seconds: float) -> StepRate:
    """Measure single actions for some seconds of processor time."""
    env = _make(plant, actions="requests", skill="make_dumplings.prepare", bounds=_BOUNDS)
    env.action_space.seed(0)
    _, info = env.reset(seed=0)
    steps, simulated = 0, 0.0
    wall, cpu = time.perf_counter(), time.process_time()
    while time.process_time() - cpu < seconds:
        before = info["time"]
        action: dict[str, Any] = {**env.action_space.sample(), "kind": np.int64(0)}
        *_, info = env.step(action)
        if info["status"] != "finished":
            raise AssertionError(info["reason"])
        steps, simulated = steps + 1, simulated + info["time"] - before
    found = StepRate(
        "one action", plant, steps, simulated, time.process_time() - cpu, time.perf_counter() - wall
    )
    env.close()
    return found


def measure_skills(plant: str, episodes: int) -> StepRate:
    """Measure whole skills, with the start of each episode."""
    env = _make(plant)
    names: tuple[str, ...] = env.get_wrapper_attr("skill_names")
    choices = [names.index(f"make_dumplings.{name}") for name in _SKILLS]
    env.reset(seed=0)  # compiles and imports
    steps, simulated = 0, 0.0
    wall, cpu = time.perf_counter(), time.process_time()
    for seed in range(episodes):
        env.reset(seed=seed)
        for choice in choices:
            *_, info = env.step(np.int64(choice))
            steps += 1
        simulated += info["time"]
    found = StepRate(
        "one skill", plant, steps, simulated, time.process_time() - cpu, time.perf_counter() - wall
    )
    env.close()
    return found


def _make(plant: str, **options: Any) -> gymnasium.Env[Any, Any]:
    aeros.gym.register_modules(_ROOT / "ecms")
    return gymnasium.make("aeros/MakeDumplings-v0", plant=plant, **options)


def _print_table(rows: list[dict[str, Any]]) -> None:
    titles = f"{'steps/s':>10}{'CPU steps/s':>13}{'simulated s/CPU s':>19}"
    print(f"{'environment':24}{'plant':10}{'steps':>7}{titles}")
    for row in rows:
        rates = (row["steps"] / row["wall"], row["steps"] / row["cpu"], row["simulated"] / row["cpu"])
        print(
            f"{row['environment']:24}{row['plant']:10}{row['steps']:7}"
            f"{rates[0]:10.2f}{rates[1]:13.2f}{rates[2]:19.2f}"
        )


def main(arguments: list[str]) -> None:
    """Measure, and print the figures."""
    parser = build_parser(__doc__, "few steps")
    parser.add_argument("--plants", nargs="+", default=["symbolic", "physics", "mujoco"], metavar="NAME")
    parser.add_argument("--panda-gym", metavar="PYTHON", help="an interpreter that has panda-gym")
    given = parser.parse_args(arguments)
    seconds, episodes = (0.1, 1) if given.quick else (10.0, 2)
    found: list[dict[str, Any]] = []
    for plant in given.plants:
        found += [asdict(measure_requests(plant, seconds)), asdict(measure_skills(plant, episodes))]
    if given.panda_gym is not None:
        command = [given.panda_gym, "-c", _FOREIGN, str(seconds)]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        found += json.loads(done.stdout.splitlines()[-1])
    if given.format == "json":
        print_json(found)
    else:
        _print_table(found)


if __name__ == "__main__":
    main(sys.argv[1:])
