"""Uses robot and scene of the distribution, in the environment that it is installed in. Prints JSON."""

from __future__ import annotations

import json
import sys

from aeros.sim.kinematic.plant import make_plant
from aeros.sim.robot.robot_file import read_robot
from aeros.skill import act
from aeros.spec.scenes.load import load_scene

robot = read_robot("kit_arm")
scene = load_scene("kit_shelf")
plant = make_plant(scene, 0, robot=robot)
begun = plant.begin(act("move_tool", target=(0.5, 0.1, 0.4), yaw=0.0, speed=0.2))
ended = plant.advance(lambda time, values: None, until=10.0)
reached = plant.observe()["tool_position"].value
sys.stdout.write(
    json.dumps(
        {
            "robot": robot.name,
            "bodies": sorted(scene.bodies),
            "completed": [one.completed for one in ended.values()],
            "reached": [round(part, 3) for part in reached],
        }
    )
)
