"""Measure how well a computer keeps the robot's millisecond; it moves the arm.

    AEROS_FRANKA=ADDRESS .venv/bin/python -m tools.franka_cycles [MOTIONS]

It moves the arm between the two postures of `aeros check-plant franka`, in its site, without a gate.
It prints, over all motions: cycles and lost cycles; the time between two states as the streaming process sees
it, and from a state to its set point.
"""

from __future__ import annotations

import os
import sys

from aeros.franka.plant import FrankaPlant
from aeros.franka.settings import read_settings
from aeros.franka.subject import END, START, load_cell
from aeros.runtime.ports import MotionCompletion
from aeros.sim.robot.robot_file import robot_of
from aeros.wired_arm.check_motions import move_joints


def main() -> None:
    """Move, and print."""
    motions = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    site = load_cell()
    model, settings = robot_of(site), read_settings(os.environ, site)
    plant = FrankaPlant(settings, model, (0.0, 0.0, 0.0), site.state)
    totals: dict[str, list[float]] = {}
    try:
        for number in range(motions):
            motion = plant.begin(move_joints(START if number % 2 == 0 else END))
            if isinstance(motion, MotionCompletion):
                raise SystemExit(str(motion.reason))
            end = plant.advance(lambda now, values: None, plant.now() + 60.0)[motion]
            if not end.completed:
                print(f"motion {number + 1}: {end.reason}")
            for name, value in plant.cycle_times.items():
                totals.setdefault(name, []).append(value)
        print(f"{motions} motions: {sum(totals['cycles']):.0f} cycles, {sum(totals['lost']):.0f} lost")
        for name, what in (("gap", "between states"), ("answer", "from state to set point")):
            middle = sorted(totals[f"{name}_p50"])[motions // 2]
            late, worst = max(totals[f"{name}_p99"]), max(totals[f"{name}_max"])
            print(f"{what}: median {_ms(middle)}, 99 % below {_ms(late)}, greatest {_ms(worst)}")
    finally:
        plant.close()


def _ms(seconds: float) -> str:
    return f"{1000.0 * seconds:.3f} ms"


if __name__ == "__main__":
    main()
