"""The kinematic plant: decided profiles are followed exactly at 240 ticks a second; objects move by geometry.

It implements `aeros.runtime.ports.Plant` with medium fidelity: motions are those of the physics plant, but
without motors, friction or inertia between a set point and the robot's position.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from aeros.runtime.ports import Reading, Readings
from aeros.sim.clock import TICK
from aeros.sim.fixed_step_plant import FixedStepPlant, PictureSource
from aeros.sim.kinematic.robot import BLOCKING_FORCE, KinematicRobot
from aeros.sim.kinematic.scanned_cell import KinematicCell
from aeros.sim.kinematic.scenes.declared_scene import DeclaredScene
from aeros.sim.kinematic.scenes.scene import KinematicScene
from aeros.sim.layouts.survey import NO_SURVEY_ERRORS
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.errors import BlockedError
from aeros.sim.robot.model import RobotModel
from aeros.sim.robot.self_contact import find_self_contact
from aeros.sim.scanners.area_sensor import AreaSensor
from aeros.sim.scanners.person_distance import RobotPosture
from aeros.spec.model.scene import Scene
from aeros.spec.model.sensor_errors import AreaScanners, SurveyErrors

_SELF_CONTACT_TICKS: Final = 12
"""Ticks between two looks for links that meet each other: 50 ms."""


class KinematicPlant(FixedStepPlant):
    """A scene simulated without physics; its clock starts at 0.

    Args:
        scene: objects, cameras and how the robot is built.
        seed: of the layout, and of the scanners' errors.
        scanners: scanners that measure how far people are; without any, nobody is ever there.
    """

    def __init__(self, scene: KinematicScene, seed: int, scanners: AreaScanners | None = None) -> None:
        self._scene = scene
        self._ticks = 0
        self._load = 0.0
        self._free_posture: tuple[float, ...] = ()  # the latest in which no links were found to meet
        self._arm = KinematicRobot(scene.robot, scene.build(RandomSource(seed)))
        super().__init__(self._arm, scene.cameras)
        scene.place_robot(self._state)
        for camera in scene.initial_cameras:
            self._pictures[camera] = self._look(camera)
        self._area_sensor: AreaSensor | None = None
        if scanners is not None:
            cell = KinematicCell(scene, self._arm, scanners.floor + scanners.height)
            chance = RandomSource(seed)
            self._area_sensor = AreaSensor(
                scanners, cell, chance, self._arm.model, carriage=scene.robot.carriage
            )
            self._area_sensor.start(self._posture())

    def now(self) -> float:
        """Implement `Plant.now`: simulated seconds since the scene was laid out."""
        return self._ticks * TICK

    def observe(self) -> Readings:
        """Implement `Plant.observe`: robot and scene now."""
        time = self.now()
        values = {
            **self._fast_values(),
            "holding": self._robot.is_holding(),
            **self._scene.measure(),
        }
        return {
            name: value if type(value) is Reading else Reading(value, time) for name, value in values.items()
        }

    def truth(self) -> Mapping[str, int]:
        """Judge the goals by what is true in the world, for a referee; nothing that acts may call it.

        Returns:
            The truth, or the number, of each state variable that the scene defines.
        """
        return self._scene.truth()

    def close(self) -> None:
        """Implement `Plant.close`: nothing to release."""

    # Internals.

    def _look(self, camera: str) -> PictureSource:
        return self._scene.see(camera, self._state, self._robot.tool_command()[1], self.now()).picture

    def _step_world(self) -> None:
        self._arm.tick()
        self._ticks += 1
        self._scene.tick(self._arm.read_sensors())

    def _measure(self) -> None:
        if self._area_sensor is not None:
            self._area_sensor.tick(self._ticks, self._posture())

    def _fast_values(self) -> dict[str, Any]:
        values = super()._fast_values()
        if self._area_sensor is not None:
            del values["human_distance"]
            if self._area_sensor.reading is not None:
                values["human_distance"] = self._area_sensor.reading
        return values

    def _posture(self) -> RobotPosture:
        return RobotPosture(self._state.q, self._state.base_position)

    def _check_tracking(self) -> None:
        before, self._load = self._load, self._robot.wrist_vertical_force()
        if self._load > BLOCKING_FORCE and self._load > before:
            raise BlockedError(f"blocked: the hand presses down with {self._load:.0f} N")
        if self._ticks % _SELF_CONTACT_TICKS == 0 and self._state.q != self._free_posture:
            contact = find_self_contact(self._arm.model, self._state.q)
            if contact is not None:
                raise BlockedError(f"blocked: `{contact[1]}` meets `{contact[0]}`")
            self._free_posture = self._state.q


def make_plant(
    scene: Scene,
    seed: int,
    survey: SurveyErrors = NO_SURVEY_ERRORS,
    scanners: AreaScanners | None = None,
    robot: RobotModel | None = None,
) -> KinematicPlant:
    """Make a kinematic plant of a scene.

    The same scene, seed and actions repeat bit for bit.

    Args:
        scene: the scene.
        seed: of the layout, which is that of the physics plant with this seed, and of the survey.
        survey: errors of surveyed places.
        scanners: scanners that measure how far people are; without any, nobody is ever there.
        robot: the robot; None for that of the reference site.

    Returns:
        The plant, its clock at 0.

    Raises:
        UserError: the scene has no robot.
    """
    return KinematicPlant(DeclaredScene(scene, survey, robot), seed, scanners)
