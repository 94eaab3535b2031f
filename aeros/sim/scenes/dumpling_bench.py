"""A bench for making one dumpling: wrapper on a tray, filling on a stand, folding press, pot.

Everything moves by motors, gravity, friction and contact.  One change is modelled: the wrapper's hinge
turns stiff ("sealed") in the tick in which measured fold, filling position and press force all pass.
Not modelled: soft dough, water, heat; cooking is dwell time in the pot.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import dist, pi
from typing import Any, Final

from aeros.sim.panda import Panda, RobotOptions
from aeros.sim.profile import TICK
from aeros.sim.randomness import Chance
from aeros.sim.scenes.furniture import MODELS, add_open_box, add_table
from aeros.sim.scenes.scene import Through, as_it_is
from aeros.sim.world import Camera, Pose, Triple, World, in_frame, of_frame, turned, yaw_of

PRESS: Final = (0.50, 0.0, 0.094)
"""Middle of the press's hinge in W, m: its bed is 80 mm high, so that fingers reach past its sides."""

TRAY: Final = (0.43, -0.28, 0.06)
"""Nominal middle of the wrapper tray's top, m."""

STAND: Final = (0.36, 0.24, 0.05)
"""Nominal middle of the filling stand's top, m."""

POT: Final = (0.55, 0.33, 0.005)
"""Middle of the pot's floor, m."""

POT_INNER: Final = (0.16, 0.17, 0.05)
"""Length, width and depth of the pot, m: open fingers (132 mm over all) fit in."""

FILLING: Final = (0.022, 0.017)
"""Side and height of the filling, m: 1 mm higher than the closed wrapper's gap, so that it is pressed."""

SPREAD: Final = 0.03
"""Tray and stand are up to this far from their nominal place in x and in y, m."""

HINGE_TO_PLATE: Final = 0.022
"""From the wrapper's hinge to the middle of plate A, m (models/wrapper.urdf)."""

PLATE_HALF: Final = (0.021, 0.028, 0.003)
"""Half edges of a plate, m (models/wrapper.urdf)."""

DOUGH_FRICTION: Final = 0.001
"""Dry friction of the open wrapper's hinge, N·m: above 2 mN·m the lid lifts the whole wrapper."""

SEALED_FRICTION: Final = 0.5
"""Dry friction of the sealed wrapper's hinge, N·m: carrying and dropping do not open it."""

FOLDED: Final = 160.0 * pi / 180.0
"""Fold from which a wrapper counts as closed, rad."""

SEALING_FORCE: Final = 1.0
"""Force of the folded plate on the filling that seals, N."""

COOKING_TIME: Final = 5.0
"""Dwell in the pot that cooks, s."""


class DumplingBench:
    """The bench.  Channels of chance: tray, wrapper, stand."""

    robot = RobotOptions()
    view = Camera(eye=(1.15, 0.55, 0.62), target=(0.42, 0.03, 0.1), field_of_view=40.0)
    things: tuple[str, ...] = ("wrapper", "filling")
    cameras: tuple[str, ...] = ()

    def build(self, world: World, robot: Panda, chance: Chance) -> None:
        """Place tray and stand by chance, the wrapper on its tray and the filling on its stand."""
        self._world = world
        add_table(world)
        self._press = world.add_urdf(str(MODELS / "press.urdf"), PRESS, fixed=True, friction=0.8)
        world.set_joint_friction(self._press, _LID, 0.005)
        world.set_joint_friction(self._press, _HANDLE, 0.0)
        add_open_box(world, POT_INNER, POT)
        self._wrapper = self._lay_wrapper(world, chance)
        self._filling = self._lay_filling(world, chance)
        self._sealed = False
        self._in_pot_ticks = 0
        self._press_force = 0.0

    @staticmethod
    def _lay_wrapper(world: World, chance: Chance) -> int:
        draw = chance.on("tray").uniform(-1.0, 1.0, 3)
        x, y = TRAY[0] + SPREAD * draw[0], TRAY[1] + SPREAD * draw[1]
        yaw = 0.4 * draw[2]
        world.add_box((0.06, 0.03, TRAY[2]), (x, y, TRAY[2] / 2), turned(yaw))
        off = chance.on("wrapper").uniform(-1.0, 1.0, 3)
        tilt = turned(yaw + 0.05 * off[2])
        hinge = Pose((x + 0.003 * off[0], y + 0.003 * off[1], TRAY[2] + PLATE_HALF[2] + 0.001), tilt)
        middle = of_frame(hinge, (HINGE_TO_PLATE, 0.0, 0.0))
        body = world.add_urdf(str(MODELS / "wrapper.urdf"), middle, tilt, friction=0.8)
        world.set_joint_friction(body, _FOLD, DOUGH_FRICTION)
        return body

    @staticmethod
    def _lay_filling(world: World, chance: Chance) -> int:
        draw = chance.on("stand").uniform(-1.0, 1.0, 3)
        x, y = STAND[0] + SPREAD * draw[0], STAND[1] + SPREAD * draw[1]
        world.add_cylinder(0.009, STAND[2], (x, y, STAND[2] / 2))
        side, height = FILLING
        place = (x, y, STAND[2] + height / 2 + 0.001)
        green = (0.35, 0.55, 0.25, 1.0)
        return world.add_box((side, side, height), place, turned(0.05 * draw[2]), mass=0.05, colour=green)

    def tick(self) -> None:
        """Measure the press force, seal when all three conditions pass, count dwell in the pot."""
        plate_b = self._world.contacts(self._wrapper, self._filling, link=_FOLD)
        self._press_force = sum(contact.force for contact in plate_b)
        if not self._sealed and self._press_force > SEALING_FORCE and self._closed_over_filling():
            self._sealed = True
            self._world.set_joint_friction(self._wrapper, _FOLD, SEALED_FRICTION)
        if self._sealed and self._in_pot():
            self._in_pot_ticks += 1

    def measure(self) -> Mapping[str, Any]:
        """Poses of wrapper, filling, press and pot, and the task's predicates.

        wrapper_position: the middle of the wrapper's hinge line at mid thickness; it belongs at
        press_position.  Supplied dough and filling stay "on the workspace" as parts of the dumpling.
        """
        plate = self._world.pose(self._wrapper)
        hinge = of_frame(plate, (-HINGE_TO_PLATE, 0.0, 0.0))
        yaw = yaw_of(plate.orientation)
        dx, dy, dz = (a - b for a, b in zip(hinge, _BELONGS, strict=True))
        wrapped = self._sealed and self._closed_over_filling()
        return {
            "wrapper_position": hinge,
            "wrapper_yaw": yaw,
            "wrapper_fold": self._fold(),
            "filling_position": self._world.pose(self._filling).position,
            "press_position": _BELONGS,
            "press_handle_position": self._world.pose(self._press, _HANDLE).position,
            "press_force": self._press_force,
            "pot_position": (POT[0], POT[1], POT[2] + POT_INNER[2]),
            "dough_on_workspace": wrapped or (dist((dx, dy), (0.0, 0.0)) < 0.04 and abs(dz) < 0.015),
            "filling_on_workspace": wrapped or self._filling_inside(),
            "wrapper_aligned": abs(dx) < 0.008
            and abs(dy) < 0.010
            and abs(dz) < 0.006
            and abs(yaw) < 8.0 * pi / 180.0,
            "dumpling_wrapped": wrapped,
            "dumpling_cooked": wrapped and self._in_pot_ticks * TICK >= COOKING_TIME,
        }

    def thing(self, name: str) -> int:
        """See `Scene`."""
        return {"wrapper": self._wrapper, "filling": self._filling}[name]

    def look(self, camera: str, through: Through = as_it_is) -> Mapping[str, Any]:
        """There is no camera: poses are measured."""
        raise KeyError(camera)

    def _fold(self) -> float:
        return self._world.joint_position(self._wrapper, _FOLD)

    def _filling_inside(self) -> bool:
        """The filling's middle is over plate A and at rest height, within 6 mm."""
        plate = self._world.pose(self._wrapper)
        x, y, z = in_frame(plate, self._world.pose(self._filling).position)
        above = z - PLATE_HALF[2] - FILLING[1] / 2
        return abs(x) < PLATE_HALF[0] and abs(y) < PLATE_HALF[1] and abs(above) < 0.006

    def _closed_over_filling(self) -> bool:
        return self._fold() > FOLDED and self._filling_inside()

    def _in_pot(self) -> bool:
        places = (self._world.pose(self._wrapper).position, self._world.pose(self._filling).position)
        return all(_inside_pot(place) for place in places)


_LID: Final = 0
_HANDLE: Final = 1
"""Joints of models/press.urdf."""

_FOLD: Final = 0
"""Joint of models/wrapper.urdf; plate B is its link."""

_BELONGS: Final[Triple] = (PRESS[0], PRESS[1], PRESS[2] - 0.011)
"""Where wrapper_position belongs: the hinges meet (8 mm half gap + 3 mm half plate)."""


def _inside_pot(place: Triple) -> bool:
    offset = [abs(a - b) for a, b in zip(place[:2], POT[:2], strict=True)]
    within = offset[0] < POT_INNER[0] / 2 and offset[1] < POT_INNER[1] / 2
    return within and POT[2] < place[2] < POT[2] + POT_INNER[2]
