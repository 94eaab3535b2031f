"""Put a box in the way of a task and count contacts: `python -m benchmarks.obstacles "make dumplings"`.

Each run is `aeros run` on the physics plant, in a process of its own, with a box of another size at another
place; a place where it would overlap with something, or touch the robot, is drawn again. Contacts of the
robot with the box are counted in the simulator at every tick, and the goal is true or false there. What the
agent says at the end is printed beside it: a task that is given up names the object that was in the way.
"""

from __future__ import annotations

import json
import random
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, Final
from unittest.mock import patch

from benchmarks.command import build_parser, print_json
from benchmarks.starts import read_run

_ROOT: Final = Path(__file__).parents[1]

_PLACES: Final = {
    "bench": ((0.28, -0.40, 0.0), (0.66, 0.42, 0.0)),
    "table": ((0.28, -1.80, 0.0), (0.70, -0.62, 0.0)),
    "stand": ((0.48, 2.25, 0.10), (0.58, 2.55, 0.10)),
}
"""Where a box may be: lowest and highest place of the middle of its underside, m."""

_SIDES: Final = (0.04, 0.10)
"""Least and greatest side of a box, m."""

_HEIGHTS: Final = (0.08, 0.40)
"""Least and greatest height of a box, m."""


def main() -> None:
    """Run the benchmark, or one run of it in this process."""
    parser = build_parser(__doc__, "one run")
    parser.add_argument("instruction")
    parser.add_argument("--on", choices=sorted(_PLACES), default="bench", help="default: bench")
    parser.add_argument("--runs", type=int, default=10)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--one", metavar="SCENE", help="one run in this process, with this scene")
    arguments = parser.parse_args()
    if arguments.one is not None:
        _run_here(arguments.instruction, arguments.one, arguments.first_seed)
        return
    runs = []
    for number in range(1 if arguments.quick else arguments.runs):
        runs.append(_run(arguments.instruction, arguments.on, arguments.first_seed + number))
        if arguments.format == "text":
            print(json.dumps(runs[-1]), flush=True)
    totals = {
        "runs": len(runs),
        "reached": sum(one["reached"] for one in runs),
        "false_claims": sum(one["believed"] and not one["reached"] for one in runs),
        "given_up_as_the_target_is_obstructed": sum(
            not one["reached"] and "at its target" in (one["reason"] or "") for one in runs
        ),
        "given_up_otherwise": [
            one["seed"] for one in runs if not one["reached"] and "at its target" not in (one["reason"] or "")
        ],
        "runs_with_contact": sum(one["contact_ticks"] > 0 for one in runs),
    }
    if arguments.format == "json":
        print_json({"instruction": arguments.instruction, **totals, "each": runs})
        return
    print(json.dumps(totals))


def _run(instruction: str, where: str, seed: int) -> dict[str, Any]:
    chance = random.Random(f"{where}-{seed}")  # noqa: S311  draws a scene
    for _ in range(20):
        box, scene = _draw(chance, where)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "box.yaml"
            path.write_text(scene, encoding="utf-8")
            command = [sys.executable, "-m", "benchmarks.obstacles", instruction, "--one", str(path)]
            command += ["--first-seed", str(seed)]
            done = subprocess.run(command, cwd=_ROOT, capture_output=True, text=True, check=False)
        last = done.stdout.strip().rpartition("\n")[2]
        run = json.loads(last) if last.startswith("{") else None
        if run is not None and run["contact_at"][:1] != [run["first_tick"]]:
            return {"seed": seed, "box_mm": box, **run}
        if run is None and "overlap" not in done.stderr + done.stdout:
            raise SystemExit(done.stdout + done.stderr)
    raise SystemExit(f"seed {seed}: no free place for the box")


def _draw(chance: random.Random, where: str) -> tuple[list[int], str]:
    """Draw a box; return its sizes and place (mm), and a scene file with it."""
    low, high = _PLACES[where]
    x, y = (chance.uniform(a, b) for a, b in zip(low[:2], high[:2], strict=True))
    width, depth, height = chance.uniform(*_SIDES), chance.uniform(*_SIDES), chance.uniform(*_HEIGHTS)
    z = low[2] + height / 2.0 + 0.001
    box = [round(1000.0 * one) for one in (x, y, z, width, depth, height)]
    px, py, pz, a, b, c = (f"{one} mm" for one in box)
    body = f"{{box: [{a}, {b}, {c}], at: [{px}, {py}, {pz}], mass: 20 kg, colour: [0.5, 0.4, 0.6]}}"
    return box, f"schema: aeros/scene/2\ndescription: a box in the way.\nbodies:\n  box_in_the_way: {body}\n"


def _run_here(instruction: str, scene: str, seed: int) -> None:
    """Run once, and print what the simulator and the agent say of it as one line of JSON."""
    from aeros.cli.main import main as run_aeros
    from aeros.sim.physics import PhysicsPlant

    ticks: list[float] = []
    touched: list[float] = []
    step = PhysicsPlant._step_world

    def step_and_count(plant: PhysicsPlant) -> None:
        step(plant)
        ticks[:] = ticks[:1] or [plant.now()]
        box = plant._scene.body("box_in_the_way")
        if plant._world.contacts(box, plant._simulated.body):
            touched.append(plant.now())

    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out"
        command = ["run", instruction, "--seed", str(seed), "--scene", scene, "--no-film"]
        command += ["--out", str(out)]
        with patch.object(PhysicsPlant, "_step_world", step_and_count):
            run_aeros([*command, "--state", str(Path(folder) / "state")])
        if not (out / "audit.jsonl").exists():
            return
        records = [json.loads(line) for line in (out / "audit.jsonl").open(encoding="utf-8")]
        events = [json.loads(line) for line in (out / "trace.jsonl").open(encoding="utf-8")]
    run = read_run(events, records, "")
    shown = {
        name: run[name] for name in ("reached", "believed", "reason", "denied", "replans", "simulated_s")
    }
    detours = sum(one["event"] == "detour" for one in records)
    counted = {"contact_ticks": len(touched), "contact_at": touched[:1], "first_tick": ticks[0]}
    print(json.dumps({**shown, "detours": detours, **counted}))


if __name__ == "__main__":
    main()
