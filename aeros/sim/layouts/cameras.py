"""Cameras of a scene, seen from W."""

from __future__ import annotations

from aeros.sim.geometry import UPRIGHT, Camera, Pose, Vector3, subtract, to_world, yaw_orientation
from aeros.spec.model.scene import SceneCamera


def camera_in_world(camera: SceneCamera, base: Vector3, tool: Vector3, yaw: float) -> Camera:
    """Return a camera of a robot in a given pose.

    Args:
        camera: the camera.
        base: position of the arm's base in W, m.
        tool: position of the tool in W, m.
        yaw: heading of the tool in W, rad.

    Returns:
        The camera, in W.
    """
    frame = {
        "cell": Pose((0.0, 0.0, 0.0), UPRIGHT),
        "base": Pose(base, UPRIGHT),
        "hand": Pose(tool, yaw_orientation(yaw)),
    }[camera.frame]
    return Camera(
        eye=to_world(frame, camera.eye),
        target=to_world(frame, camera.target),
        up=subtract(to_world(frame, camera.up), frame.position),
        field_of_view=camera.field_of_view,
        width=camera.width,
        height=camera.height,
    )


def fixed_camera(camera: SceneCamera) -> Camera:
    """Return a camera that is fixed in W.

    Args:
        camera: the camera.

    Returns:
        The camera, in W.
    """
    return camera_in_world(camera, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0)
