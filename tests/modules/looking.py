"""Perceivers of the shipped modules, and pictures for them: of a scene as it is put, or drawn top by top."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from aeros.perception import Estimate, Picture, View
from aeros.perception.points import point_cloud
from aeros.perception.view import Sample
from aeros.sim.geometry import UPRIGHT, Camera, Pose
from aeros.sim.layouts.cameras import fixed_camera
from aeros.sim.layouts.coating import CoatingMap
from aeros.sim.layouts.placement import place_things
from aeros.sim.pictures.ray_caster import cast
from aeros.sim.pictures.scene_solids import SceneSolids, decals_of
from aeros.sim.randomness import RandomSource
from aeros.spec.model.scene import BodyPart
from tests.shipped_scenes import CAMERAS, shipped_scene

Colour = tuple[int, int, int]
GREY: Colour = (128, 128, 128)
TABLE: Colour = (200, 200, 200)


def code_of(module: str) -> ModuleType:
    """The file `perceivers.py` of a shipped module."""
    return import_module(f"ecms.{module}.perceivers")


@dataclass
class Watched:
    """A perceiver that is called with one picture after the other."""

    module: str
    name: str
    readings: dict[str, Any] = field(default_factory=dict)
    pictures: dict[str, Picture] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._body: Any = None

    def see(
        self, time: float, *pictures: Picture, samples: Mapping[str, Iterable[float]] | None = None
    ) -> Any:
        """The answer to a view with these new pictures."""
        self.pictures |= {one.camera: one for one in pictures}
        sampled = {
            name: tuple(Sample(time, value) for value in values) for name, values in (samples or {}).items()
        }
        view = View(time, dict(self.pictures), dict(self.readings), sampled)
        if self._body is None:
            self._body = getattr(code_of(self.module), self.name)(view)
            self.answer = next(self._body)
        else:
            self.answer = self._body.send(view)
        return {
            name: value.value if type(value) is Estimate else value for name, value in self.answer.items()
        }


class Top(NamedTuple):
    """A top: a rectangle, or a disc of radius `half[0]`; m and rad. A slope lowers it along its length."""

    x: float
    y: float
    z: float
    half: tuple[float, float]
    colour: Colour
    yaw: float = 0.0
    is_round: bool = False
    slope: float = 0.0


def draw(
    camera: Camera, tops: Iterable[Top], *, name: str = "overhead", time: float = 0.0, ground: Colour = TABLE
) -> Picture:
    """Draw these tops over the ground at z = 0 as a camera sees them that looks straight down."""
    height = camera.eye[2]
    ones = np.ones((camera.height, camera.width))
    rays = point_cloud(ones, camera.eye, camera.target, camera.up, camera.field_of_view) - np.array(
        camera.eye
    )
    depth = np.full((camera.height, camera.width), height)
    rgb = np.full((camera.height, camera.width, 3), ground, np.uint8)
    for top in tops:
        # Where a ray meets a slope is found step by step: rays are nearly vertical.
        here = np.full_like(depth, height - top.z)
        for _ in range(8 if top.slope else 1):
            x = camera.eye[0] + here * rays[:, :, 0] - top.x
            y = camera.eye[1] + here * rays[:, :, 1] - top.y
            u, v = x * np.cos(top.yaw) + y * np.sin(top.yaw), y * np.cos(top.yaw) - x * np.sin(top.yaw)
            here = height - top.z + top.slope * u
        inside = (
            np.hypot(u, v) < top.half[0] if top.is_round else (abs(u) < top.half[0]) & (abs(v) < top.half[1])
        )
        seen = inside & (here < depth)
        depth[seen] = here[seen]
        rgb[seen] = top.colour
    return as_picture(camera, rgb, depth, name, time)


def as_picture(camera: Camera, rgb: Any, depth: Any, name: str, time: float = 0.0) -> Picture:
    """Colours and depth as a picture of a camera."""
    return Picture(
        name,
        time,
        rgb,
        depth.astype(np.float32),
        camera.eye,
        camera.target,
        camera.up,
        camera.field_of_view,
        (camera.width, camera.height),
    )


class Put:
    """A shipped scene at the start of a seed, in which bodies can be put elsewhere.

    Attributes:
        poses: where everything is.
        joints: positions of joints, as `wrapper.fold`; 0 for the others.
        coatings: the coatings.
    """

    def __init__(self, scene: str, seed: int = 3) -> None:
        self.scene = shipped_scene(scene)
        self.poses: dict[str, Pose] = dict(place_things(self.scene, RandomSource(seed)))
        self.joints: dict[str, float] = {}
        self.coatings = {name: CoatingMap(one) for name, one in self.scene.coatings.items()}
        self._solids = SceneSolids(self.scene)

    def put(self, body: str, x: float, y: float, z: float, orientation: Any = UPRIGHT) -> None:
        """Put a body somewhere."""
        self.poses[body] = Pose((x, y, z), orientation)

    def remove(self, *bodies: str) -> None:
        """Put bodies where no camera sees them."""
        for body in bodies:
            self.put(body, 0.0, 0.0, -9.0)

    def pose_of(self, part: BodyPart) -> Pose:
        return self.poses[part.body]

    def joint_position(self, joint: BodyPart) -> float:
        return self.joints.get(f"{joint.body}.{joint.part}", 0.0)

    def look(self, name: str, time: float = 0.0, camera: Camera | None = None) -> Picture:
        """A picture of one of its cameras, as its module names it, which does not move, or of another one."""
        names = CAMERAS["clean_table"] if self.scene.name == "table" else {}
        view = fixed_camera(self.scene.cameras[names.get(name, name)]) if camera is None else camera
        rgb, depth = cast(view, self._solids.placed(self), decals_of(self.coatings))
        return as_picture(view, rgb, depth, name, time)
