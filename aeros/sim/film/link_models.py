"""Visible meshes of a robot's links, for viewers: of a URDF in PyBullet's data, where they are installed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import islice
from typing import Final
from xml.etree.ElementTree import ParseError

import numpy as np

from aeros.kinematic_chain import JointFrame, frames_of, mounting_of
from aeros.runtime.ports import ColouredMesh, Hull, LinkModel
from aeros.sim.film.meshes import Array, meshes_of_urdf, stock_urdf_file
from aeros.sim.geometry import Pose, compose, to_world
from aeros.sim.pictures.urdf_model import UrdfVisuals
from aeros.sim.robot.model import RobotModel, StandingArm

_MARGIN: Final = 0.01
"""Greatest distance between the boxes around a mesh and its hull, m: hulls leave out up to 5 mm of it."""


def link_models(model: RobotModel) -> dict[Hull, LinkModel]:
    """Read what the links of a robot look like. Fingers are as far apart as they can be.

    Args:
        model: the robot.

    Returns:
        The links that have meshes, by their hull; without those whose hull has more, as an adapter
        for the hand. Of an arm whose robot file names no meshes, they are not installed or cannot be read, or
        one of them is outside of all hulls, and so of another robot, there are none.
    """
    hulls = iter(model.body.hulls)
    own = tuple(islice(hulls, len(model.body.hulls) - sum(len(_hulls(arm)) for arm in model.standing_arms)))
    found = _own_models(model, own)
    for arm in model.standing_arms:
        frames, mount = frames_of(arm.model.mountings, arm.posture), arm.mount.frame
        of_arm = link_models(arm.model)
        for hull, carried in zip(_hulls(arm), hulls, strict=False):
            if hull in of_arm:
                frame = frames[hull.joint]
                found[carried] = of_arm[hull]._replace(
                    surfaces=tuple(
                        one._replace(corners=[mount.to_base(frame.to_base(corner)) for corner in one.corners])
                        for one in of_arm[hull].surfaces
                    )
                )
    return found


def _hulls(arm: StandingArm) -> tuple[Hull, ...]:
    return arm.model.body.hulls


def _own_models(model: RobotModel, hulls: Sequence[Hull]) -> dict[Hull, LinkModel]:
    """Read what links look like that are no standing arm's."""
    urdf = model.meshes
    path = None if urdf is None else stock_urdf_file(urdf.path)
    if urdf is None or path is None:
        return {}
    found: dict[Hull, LinkModel] = {}
    frames = frames_of(map(mounting_of, model.body.dh_rows), [0.0] * model.joint_count)
    try:
        visuals = UrdfVisuals(str(path))
        opened = dict.fromkeys(visuals.sliding_joints, model.hand.widest_gap / 2.0)
        for one in meshes_of_urdf(path):
            joint = len(set(visuals.joints_above(one.link)) & set(urdf.joints))
            pose = compose(visuals.link_pose(one.link, opened), one.place)
            corners = _in_joint_frame(frames[joint], pose, one.mesh.corners)
            hull = _hull_around(corners, (each for each in hulls if each.joint == joint))
            if hull is None:
                return {}
            surface = ColouredMesh(corners.tolist(), one.mesh.triangles.tolist(), one.mesh.colour)
            known = found[hull].surfaces if hull in found else ()
            found[hull] = LinkModel((*known, surface), f"{urdf.path}: {model.licence}")
    except (LookupError, OSError, ParseError, ValueError):
        return {}
    return {hull: one for hull, one in found.items() if _fills(one, hull)}


def _in_joint_frame(frame: JointFrame, pose: Pose, corners: Array) -> Array:
    """Transform points (n, 3) from a frame, whose pose in B is given, to the frame of a joint."""
    axes = [
        np.subtract(to_world(pose, one), pose.position) for one in ((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0))
    ]
    in_base = pose.position + corners @ np.array(axes)
    return np.asarray((in_base - frame.origin) @ np.array(frame[1:]).T)


def _hull_around(corners: Array, hulls: Iterable[Hull]) -> Hull | None:
    """Return the smallest hull whose box, with a margin, has all points inside; None if none has."""
    low, high = corners.min(axis=0) + _MARGIN, corners.max(axis=0) - _MARGIN
    around = []
    for hull in hulls:
        points = np.array(hull.corners)
        lowest, highest = points.min(axis=0), points.max(axis=0)
        if (lowest <= low).all() and (high <= highest).all():
            around.append((float(np.prod(highest - lowest)), hull.link, hull))
    return min(around)[2] if around else None


def _fills(model: LinkModel, hull: Hull) -> bool:
    """Return True if the box around a link's surfaces is not smaller than that around its hull."""
    points = np.concatenate([np.array(one.corners) for one in model.surfaces])
    corners = np.array(hull.corners)
    return bool(
        (points.min(axis=0) <= corners.min(axis=0) + _MARGIN).all()
        and (points.max(axis=0) >= corners.max(axis=0) - _MARGIN).all()
    )
