"""Listeners that come and go get a description of the robot, and each transform on one topic alone."""

from __future__ import annotations

from xml.etree.ElementTree import fromstring

import pytest

from aeros.runtime.bus.chain_publisher import ChainPublisher
from aeros.runtime.bus.in_process import InProcessBus
from aeros.runtime.bus.messages import String, TFMessage
from aeros.runtime.ports import Reading, RobotBody
from aeros.spec.model.site import Site
from tests.unit.runtime.one_joint import PLAN, governed


def publish(site: Site, bodies: tuple[RobotBody | None, ...]) -> InProcessBus:
    """A bus that has heard of each body once, a second apart."""
    bus = InProcessBus()
    chain = ChainPublisher(bus, governed(site, "move"))
    for time, body in enumerate(bodies):
        readings = {"joint_angle": Reading((0.5,), float(time))}
        chain.publish(readings, body, (0.0, 0.0, 0.0))
    return bus


def children(message: TFMessage | None) -> list[str]:
    assert message is not None
    return [one.child_frame_id for one in message.transforms]


def test_someone_who_comes_later_gets_description_and_fixed_transform(site: Site) -> None:
    bus = publish(site, (PLAN.body, PLAN.body))
    description = bus.subscribe("/robot_description", String).receive()
    assert description is not None
    robot = fromstring(description.data)  # noqa: S314 - our own text
    links = [link.attrib["name"] for link in robot.findall("link")]
    assert links == ["base", "shoulder_link", "tool"]
    assert children(bus.subscribe("/tf_static", TFMessage).receive()) == ["tool"]


def test_no_transform_is_on_two_topics(site: Site) -> None:
    bus = InProcessBus()
    moving, fixed = bus.subscribe("/tf", TFMessage), bus.subscribe("/tf_static", TFMessage)
    chain = ChainPublisher(bus, governed(site, "move"))
    chain.publish({"joint_angle": Reading((0.5,), 1.0)}, PLAN.body, (0.0, 0.0, 0.0))
    assert children(moving.receive()) == ["base", "shoulder_link"]
    assert children(fixed.receive()) == ["tool"]


@pytest.mark.parametrize("body", [None, PLAN.body])
def test_an_unknown_body_is_not_described(site: Site, body: RobotBody | None) -> None:
    bus = publish(site, (body,))
    is_described = bus.subscribe("/robot_description", String).receive() is not None
    assert is_described == (body is not None)
