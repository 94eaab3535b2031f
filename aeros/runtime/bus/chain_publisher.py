"""Publisher of a robot's chain: its description and its transforms."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from aeros.runtime.bus.change_publisher import ChangePublisher
from aeros.runtime.bus.measurement_messages import motion_joints
from aeros.runtime.bus.messages import String, TFMessage, stamp
from aeros.runtime.bus.port import PublisherFactory
from aeros.runtime.bus.robot_description import LinkVisual, robot_description, without_meshes
from aeros.runtime.bus.transforms import chain_transforms
from aeros.runtime.ports import Hull, Readings, RobotBody, Vec3
from aeros.spec.model.site import Site


class ChainPublisher:
    """Publisher of `/tf`, `/tf_static` and `/robot_description`.

    The tool's frame, which never moves in its parent, is on `/tf_static` alone.

    Args:
        bus: bus to publish on.
        site: declares the joints.
        visuals: returns the meshes of a link for the description, by its hull.
    """

    def __init__(
        self,
        bus: PublisherFactory,
        site: Site,
        visuals: Callable[[Hull], Sequence[LinkVisual]] = without_meshes,
    ) -> None:
        self._site, self._visuals = site, visuals
        self._joints = motion_joints(site)
        self._transforms = ChangePublisher(bus.publisher("/tf", TFMessage))
        self._described: RobotBody | None = None
        self._static = bus.publisher("/tf_static", TFMessage, latched=True)
        self._description = bus.publisher("/robot_description", String, latched=True)

    def publish(self, readings: Readings, body: RobotBody | None, base: Vec3 | None) -> None:
        """Publish the chain at measured joint positions.

        Args:
            readings: value (SI) and plant time (s) of each state variable, by name.
            body: the chain; None if unknown, then nothing is published.
            base: position of the base in the world frame, m; None if unknown.
        """
        if self._joints is None or body is None:
            return
        name, joints = self._joints
        if name not in readings:
            return
        q, time = readings[name].value, readings[name].time
        message = chain_transforms(body, base, joints, q, stamp(time))
        is_new, self._described = body != self._described, body
        if is_new:
            text = robot_description(self._site.id, body, joints, self._visuals)
            self._description.publish(String(text))
        *moving, tool = message.transforms
        if is_new:
            self._static.publish(TFMessage((tool,)))
        self._transforms.publish(TFMessage(tuple(moving)))
