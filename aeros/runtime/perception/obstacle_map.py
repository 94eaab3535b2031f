"""Map of obstacles: what the pictures of the site's cameras show in the volumes that it watches.

Nothing is an obstacle that is of the robot, of what it holds, or in the space of an object that a module
measures where it is (`occupies`), in sizes that the site allows. All else is one, whatever a module says.
An obstacle keeps its name and its place until a picture shows that its space, or the upper part of it, is
free, or something of another size there. While something hides it, it stays.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import product
from math import inf
from typing import TYPE_CHECKING, Final

from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.motion.kinematic_bounds import ForwardKinematics
from aeros.runtime.perception.posture_log import PostureLog, value_of
from aeros.runtime.ports import CameraPicture, Obstacle, Readings, RobotBody, Vec3
from aeros.spec.expr.scope import AxisAlignedBox
from aeros.spec.model.motion import MotionPolicy, ObstaclePolicy

if TYPE_CHECKING:
    from aeros.perception.obstacles import DepthPicture, KnownThings, SpaceBox

_SHOWN: Final = 0.3
"""Least share of an obstacle's space that a picture must show to say anything of it."""

_FREE: Final = 0.9
"""Share of that space which must be free for the obstacle to be gone."""

_LOWER_TOPS: Final = (0.875, 0.75, 0.625, 0.5, 0.375, 0.25, 0.125)
"""Shares of its height to which an obstacle may be lowered whose upper part a picture shows free."""

_SAME_PLACE: Final = 0.01
"""Greatest difference of two boxes of one thing that stands still, m: the box that was known stays."""


class ObstacleMap:
    """The obstacles that are known, under one motion policy with obstacles.

    Args:
        postures: of the robot, as it was when a picture was taken.
    """

    def __init__(self, postures: PostureLog) -> None:
        self._postures = postures
        self._known: list[Obstacle] = []
        self._looked_at: dict[str, float] = {}
        self._count = 0

    def look(
        self,
        configuration: Configuration,
        pictures: Mapping[str, CameraPicture],
        readings: Readings,
        body: RobotBody,
    ) -> None:
        """Update the map with the pictures that are new.

        Args:
            configuration: site with a motion policy that has obstacles, and modules.
            pictures: newest picture of each camera.
            readings: readings of now, with those of perceivers.
            body: the robot.
        """
        site = configuration.site
        motion = site.motion
        if motion is None or motion.obstacles is None:
            return
        for camera, picture in sorted(pictures.items(), key=lambda one: (one[1].time, one[0])):
            if picture.depth is None or picture.time <= self._looked_at.get(camera, -1.0):
                continue
            self._looked_at[camera] = picture.time
            sees = site.cameras[camera].sees if camera in site.cameras else frozenset[str]()
            if sees:
                known = self._known_things(
                    configuration, motion, motion.obstacles, readings, picture.time, body
                )
                self._update(camera, picture, sees, motion.obstacles, known)

    def obstacles(self) -> tuple[Obstacle, ...]:
        """Return the obstacles that are known.

        Returns:
            The obstacles, oldest first.
        """
        return tuple(self._known)

    def _update(
        self,
        camera: str,
        picture: CameraPicture,
        sees: frozenset[str],
        policy: ObstaclePolicy,
        everywhere: KnownThings,
    ) -> None:
        # NumPy, which the runtime does without where nothing is perceived.
        from aeros.perception.obstacles import (
            SpaceBox,
            WatchedSpace,
            depth_picture,
            find_obstacles,
            share_seen_free,
        )

        size = (picture.width, picture.height)
        seen = depth_picture(picture.depth or b"", size, picture.view)
        margin = float(policy.margin)
        kept = self._known
        for volume in policy.volumes:
            if volume.name not in sees:
                continue
            if volume.explained_within is not None:
                known = everywhere._replace(within=float(volume.explained_within))
            else:
                known = everywhere
            most = inf if volume.greatest_height is None else float(volume.greatest_height)
            space = WatchedSpace(_as_box(volume.box), float(volume.surface), float(volume.least_height), most)
            found = [
                SpaceBox(_lowered(one.grown(margin).lower, one.lower), one.grown(margin).upper)
                for one in find_obstacles(seen, [space], known)
            ]
            others = [one for one in kept if one.volume != volume.name]
            stayed: list[Obstacle] = []
            for old in kept:
                if old.volume != volume.name:
                    continue
                same = [box for box in found if box.meets(SpaceBox(old.lower, old.upper))]
                shown, free = share_seen_free(seen, SpaceBox(old.lower, old.upper).grown(-margin))
                if same:
                    found = [box for box in found if box not in same]
                    new = same[0]
                    for box in same[1:]:
                        new = new.joined(box)
                    if shown < 1.0 - _SHOWN:
                        new = new.joined(SpaceBox(old.lower, old.upper))
                    if _is_same(new, old):
                        new = SpaceBox(old.lower, old.upper)
                    stayed.append(Obstacle(old.name, *new, picture.time, camera, volume.name))
                elif shown < _SHOWN:
                    stayed.append(old)
                elif free < _FREE:
                    left = old._replace(upper=(*old.upper[:2], _top_not_seen_free(seen, old, margin)))
                    is_high = left == old or left.upper[2] >= space.surface + space.least_height + margin
                    if is_high and not _is_explained(left, known):
                        stayed.append(left)
            stayed += [self._new(box, picture.time, camera, volume.name) for box in found]
            kept = [*others, *stayed]
        self._known = kept

    def _new(self, box: SpaceBox, seen: float, camera: str, volume: str) -> Obstacle:
        self._count += 1
        return Obstacle(f"unknown-object-{self._count}", box.lower, box.upper, seen, camera, volume)

    def _known_things(
        self,
        configuration: Configuration,
        motion: MotionPolicy,
        policy: ObstaclePolicy,
        readings: Readings,
        time: float,
        body: RobotBody,
    ) -> KnownThings:
        """Return what may be in a picture of that time and is no obstacle."""
        from aeros.perception.obstacles import KnownThings

        objects, within = list(_explained(configuration, readings, time)), float(policy.explained_within)
        posture = self._postures.at(time)
        if posture is None:
            return KnownThings(objects, (), (), within)
        _, joints, base = posture
        frames = ForwardKinematics(body, joints).frames
        balls = [(_add(frames[ball.joint].to_base(ball.centre), base), ball.radius) for ball in body.balls]
        moving = (one for one in motion.barriers if one.is_in_base_frame and not one.keep_inside)
        own = [_moved(barrier.box, base) for barrier in moving]
        if motion.held is not None and value_of(readings.get(motion.held.variable)) is not False:
            corners = product(*zip(motion.held.box.lower, motion.held.box.upper, strict=True))
            places = [
                _add(frames[-1].to_base(_add(body.tool_offset, (float(x), float(y), float(z)))), base)
                for x, y, z in corners
            ]
            own.append(_around(places))
        return KnownThings(objects, own, balls, within)


def _explained(configuration: Configuration, readings: Readings, time: float) -> Iterator[SpaceBox]:
    """Yield the spaces of objects that modules measure."""
    for ecm in configuration.modules.values():
        for name, declared in ecm.state.items():
            reading = readings.get(name)
            if declared.occupies is None or reading is None or declared.max_age is None:
                continue
            if time - reading.time <= float(declared.max_age):
                yield _moved(declared.occupies, reading.value)


def _moved(box: AxisAlignedBox, by: Vec3) -> SpaceBox:
    from aeros.perception.obstacles import SpaceBox

    lower, upper = _as_box(box)
    return SpaceBox(_add(lower, by), _add(upper, by))


def _as_box(box: AxisAlignedBox) -> SpaceBox:
    from aeros.perception.obstacles import SpaceBox

    (ax, ay, az), (bx, by, bz) = box.lower, box.upper
    return SpaceBox((float(ax), float(ay), float(az)), (float(bx), float(by), float(bz)))


def _around(places: list[Vec3]) -> SpaceBox:
    from aeros.perception.obstacles import SpaceBox

    xs, ys, zs = zip(*places, strict=True)
    return SpaceBox((min(xs), min(ys), min(zs)), (max(xs), max(ys), max(zs)))


def _lowered(grown: Vec3, lower: Vec3) -> Vec3:
    """Return the grown corner with the height of the surface, which nothing is below."""
    return (grown[0], grown[1], lower[2])


def _is_explained(old: Obstacle, known: KnownThings) -> bool:
    """Check if the middle of an obstacle's top is in a space that is known now."""
    x, y, z = ((a + b) / 2.0 for a, b in zip(old.lower, old.upper, strict=True))
    top = max(z, old.upper[2] - known.within)
    places = (box.grown(known.within) for box in known.objects)
    return any(
        all(a <= p <= b for a, p, b in zip(box.lower, (x, y, top), box.upper, strict=True)) for box in places
    )


def _top_not_seen_free(seen: DepthPicture, old: Obstacle, margin: float) -> float:
    """Return the height up to which a picture does not show an obstacle's space free, m.

    What was high when it was seen, as somebody carried it, or as something lay on it, may be lower now.
    """
    from aeros.perception.obstacles import SpaceBox, share_seen_free

    (left, near, low), (right, far, high) = SpaceBox(old.lower, old.upper).grown(-margin)
    top = old.upper[2]
    for share in _LOWER_TOPS:
        lower = low + share * (high - low)
        # The upper half of the box that is looked at is above that height.
        above = SpaceBox((left, near, 2.0 * lower - high), (right, far, high))
        shown, free = share_seen_free(seen, above)
        if shown < _SHOWN or free < _FREE:
            break
        top = lower + margin
    return top


def _is_same(new: SpaceBox, old: Obstacle) -> bool:
    corners = zip((*new.lower, *new.upper), (*old.lower, *old.upper), strict=True)
    return all(abs(a - b) <= _SAME_PLACE for a, b in corners)


def _add(a: Vec3, b: Vec3) -> Vec3:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])
