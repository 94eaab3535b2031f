"""Program that moves the stub's arm until Ctrl-C comes."""

import sys

from aeros.franka.plant import FrankaPlant
from aeros.runtime.ports import MotionCompletion
from aeros.sim.robot.robot_file import read_robot
from aeros.skill import Action
from tests.unit.franka.stub.arms import READY, SETTINGS

if __name__ == "__main__":
    joints = {f"q{number}": q + 0.3 for number, q in enumerate(READY, 1)}
    plant = FrankaPlant(SETTINGS, read_robot("franka_fr3"), (0.0, 0.0, 0.0), ())
    begun = plant.begin(Action("move_joints", {**joints, "speed": 0.05}))
    assert not isinstance(begun, MotionCompletion)
    try:
        plant.advance(lambda now, values: None, plant.now() + 0.2)
        sys.stdout.write("moving\n")
        sys.stdout.flush()
        plant.advance(lambda now, values: None, plant.now() + 20.0)
    except KeyboardInterrupt:
        plant.stop()
    finally:
        plant.close()
