"""Publisher of a run: turns records and measurements into messages on their topics.

A message that cannot be made or published is counted, and does not affect the others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import NamedTuple

from aeros.runtime.bus.chain_publisher import ChainPublisher
from aeros.runtime.bus.change_publisher import ChangePublisher
from aeros.runtime.bus.measurement_messages import (
    joint_families,
    point_message,
    position_variables,
    scalar_message,
    scalar_variables,
)
from aeros.runtime.bus.messages import (
    Clock,
    CompressedImage,
    DecisionMessage,
    Event,
    JointState,
    LogMessage,
    PointStamped,
    Time,
    stamp,
)
from aeros.runtime.bus.names import check_ros_name
from aeros.runtime.bus.picture_messages import picture_message
from aeros.runtime.bus.port import PublisherFactory
from aeros.runtime.bus.record_messages import log_message, parse_record
from aeros.runtime.bus.robot_description import LinkVisual, without_meshes
from aeros.runtime.ports import CameraPicture, Hull, Readings, RobotBody, Vec3
from aeros.spec.model.site import Site


class RobotChain(NamedTuple):
    """Robot as its plant described it.

    Attributes:
        body: None if unknown.
        base: position of the base in the world frame, m; None if unknown.
    """

    body: RobotBody | None = None
    base: Vec3 | None = None


class MessagePublisher:
    """Publisher of records and measurements.

    Args:
        bus: bus to publish on.
        site: declares the state variables. Variables whose names are invalid in ROS 2 topics are left out.
        missed: called with the reason for each message that cannot be made or published.
        is_live: True for a bus whose listeners need the plant's clock: publish `/clock`, too.
        visuals: returns the meshes of a link for the robot's description, by its hull.
    """

    def __init__(
        self,
        bus: PublisherFactory,
        site: Site,
        missed: Callable[[str], None],
        *,
        is_live: bool = False,
        visuals: Callable[[Hull], Sequence[LinkVisual]] = without_meshes,
    ) -> None:
        self._missed = missed
        self._last = Time()  # on the plant's clock
        self._joints = [
            (family, ChangePublisher(bus.publisher("/joint_states", JointState)))
            for family in joint_families(site)
        ]
        self._places = {
            name: ChangePublisher(bus.publisher(topic, PointStamped))
            for name in position_variables(site)
            if (topic := _topic_of(name)) is not None
        }
        self._singles = {
            name: (kind, ChangePublisher(bus.publisher(topic, kind)))
            for name, kind in scalar_variables(site).items()
            if (topic := _topic_of(name)) is not None
        }
        self._cameras = {
            name: bus.publisher(topic, CompressedImage, latched=True)
            for name in site.cameras
            if (topic := ros_name(f"/aeros/camera/{name}/compressed")) is not None
        }
        self._chain = ChainPublisher(bus, site, visuals)
        self._clock = ChangePublisher(bus.publisher("/clock", Clock)) if is_live else None
        self._events = bus.publisher("/aeros/events", Event)
        self._decisions = bus.publisher("/aeros/decisions", DecisionMessage)
        self._log = bus.publisher("/aeros/log", LogMessage)

    def publish_record(self, line: bytes) -> None:
        """Publish a record; a decision also goes to `/aeros/decisions`.

        Args:
            line: line of the audit log.
        """
        with count_failures(self._missed):
            event, decision = parse_record(line, self._last)
            self._events.publish(event)
            if decision is not None:
                self._decisions.publish(decision)
            text = log_message(line, self._last)
            if text is not None:
                self._log.publish(text)

    def publish_state(self, readings: Readings, chain: RobotChain) -> None:
        """Publish measurements and the transforms of the robot's chain.

        Args:
            readings: value (SI) and plant time (s) of each state variable, by name.
            chain: kinematic chain of the robot, and the pose of its base.
        """
        if not readings:
            return
        with count_failures(self._missed):
            self._last = stamp(max(reading.time for reading in readings.values()))
            if self._clock is not None:
                self._clock.publish(Clock(self._last))
        for joints, states in self._joints:
            with count_failures(self._missed):
                for message in joints.joint_state_messages(readings):
                    states.publish(message)
        for name, places in self._places.items():
            if name in readings:
                with count_failures(self._missed):
                    places.publish(point_message(readings[name]))
        for name, (kind, singles) in self._singles.items():
            if name in readings:
                with count_failures(self._missed):
                    singles.publish(scalar_message(readings[name], kind))
        with count_failures(self._missed):
            self._chain.publish(readings, chain.body, chain.base)

    def publish_picture(self, picture: CameraPicture) -> None:
        """Publish a picture of a camera of the site.

        Args:
            picture: the picture.
        """
        if picture.camera in self._cameras:
            with count_failures(self._missed):
                self._cameras[picture.camera].publish(picture_message(picture))


@contextmanager
def count_failures(missed: Callable[[str], None]) -> Iterator[None]:
    """Count messages that cannot be made or published: a wrong value or a broken bus stops nothing else.

    Args:
        missed: called with the reason.
    """
    try:
        yield
    except Exception as wrong:
        missed(str(wrong) or type(wrong).__name__)


def _topic_of(name: str) -> str | None:
    """Return the topic of a state variable, `MODULE/NAME` for a module's; None if ROS 2 has no such name."""
    return ros_name(f"/aeros/state/{name.replace('.', '/')}")


def ros_name(topic: str) -> str | None:
    """Return the name of a topic; None if it is none in ROS 2.

    Args:
        topic: absolute name.

    Returns:
        The name.
    """
    try:
        check_ros_name(topic)
    except ValueError:
        return None
    return topic
