"""Records and measurements become messages on their topics; a failure hides nothing else."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from aeros.runtime.bus.message_publisher import MessagePublisher, RobotChain
from aeros.runtime.bus.messages import (
    BoolStamped,
    DecisionMessage,
    Event,
    Float64Stamped,
    JointState,
    LogMessage,
    Message,
    PointStamped,
    String,
    TFMessage,
)
from aeros.runtime.bus.port import M
from aeros.runtime.ports import Reading
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL
from aeros.spec.model.site import Site
from tests.unit.runtime.conftest import METRES, declare
from tests.unit.runtime.one_joint import PLAN, governed

DECISION = (
    b'{"details":{"decided":null,"module":"m","reasons":[],"skill":"s","verdict":"DENY"},'
    b'"event":"decision","sequence":4}'
)
NOTE = b'{"details":{},"event":"note","sequence":3}'
UNKNOWN = RobotChain()


class Topics:
    """Keeps what is published, in order; refuses what `fails`."""

    def __init__(self) -> None:
        self.heard: list[tuple[str, Message]] = []
        self.kinds: dict[str, type[Message]] = {}
        self.fails = ""

    def publisher(self, topic: str, kind: type[M], *, latched: bool = False) -> Any:
        self.kinds[topic] = kind
        return _Topic(self, topic)

    def on(self, topic: str) -> list[Any]:
        return [message for name, message in self.heard if name == topic]


class _Topic:
    def __init__(self, topics: Topics, name: str) -> None:
        self._topics, self._name = topics, name

    def publish(self, message: Message) -> None:
        if self._name == self._topics.fails:
            raise RuntimeError
        self._topics.heard.append((self._name, message))


@pytest.fixture
def one_joint(site: Site) -> Site:
    """A site with a joint, a place, a distance, a truth, and a name that ROS 2 does not allow."""
    odd = declare("a__b", METRES, t.VariableRole.STATE)
    moving = governed(site, "move")
    return replace(moving, state={**moving.state, "a__b": odd})


@pytest.fixture
def topics() -> Topics:
    return Topics()


@pytest.fixture
def missed() -> list[str]:
    return []


@pytest.fixture
def publisher(one_joint: Site, topics: Topics, missed: list[str]) -> MessagePublisher:
    return MessagePublisher(topics, one_joint, missed.append)


@pytest.mark.usefixtures("publisher")
def test_each_variable_has_a_topic_unless_its_name_is_invalid_in_ros(topics: Topics) -> None:
    assert topics.kinds == {
        "/joint_states": JointState,
        "/aeros/state/tool_position": PointStamped,
        "/aeros/state/human_distance": Float64Stamped,
        "/aeros/state/holding": BoolStamped,
        "/tf": TFMessage,
        "/tf_static": TFMessage,
        "/aeros/events": Event,
        "/aeros/decisions": DecisionMessage,
        "/aeros/log": LogMessage,
        "/robot_description": String,
    }


def test_a_variable_of_a_module_has_a_topic_below_the_modules_name(
    one_joint: Site, topics: Topics, missed: list[str]
) -> None:
    hot = declare("kettle.water_hot", BOOL, t.VariableRole.STATE)
    with_kettle = replace(one_joint, state={**one_joint.state, hot.name: hot})
    publisher = MessagePublisher(topics, with_kettle, missed.append)
    assert topics.kinds["/aeros/state/kettle/water_hot"] is BoolStamped
    publisher.publish_state({hot.name: Reading(True, 1.0)}, UNKNOWN)
    assert [one.value for one in topics.on("/aeros/state/kettle/water_hot")] == [True]


def test_a_record_is_an_event_and_a_decision_is_a_message_too(
    publisher: MessagePublisher, topics: Topics
) -> None:
    publisher.publish_record(NOTE)
    publisher.publish_record(DECISION)
    assert [one.record for one in topics.on("/aeros/events")] == [3, 4]
    assert [one.record for one in topics.on("/aeros/decisions")] == [4]


def test_a_record_without_a_time_takes_the_newest_measured_time(
    publisher: MessagePublisher, topics: Topics
) -> None:
    publisher.publish_record(NOTE)
    publisher.publish_state({"holding": Reading(True, 2.0), "human_distance": Reading(1.0, 5.0)}, UNKNOWN)
    publisher.publish_record(NOTE)
    publisher.publish_state({}, UNKNOWN)
    publisher.publish_record(NOTE)
    assert [one.stamp.sec for one in topics.on("/aeros/events")] == [0, 5, 5]


def test_every_measured_variable_is_published_on_its_topic(
    publisher: MessagePublisher, topics: Topics, missed: list[str]
) -> None:
    values = {
        "joint_angle": (0.5,),
        "tool_position": (1.0, 2.0, 3.0),
        "human_distance": 4.0,
        "holding": True,
        "a__b": 9.0,
    }
    publisher.publish_state({name: Reading(value, 1.0) for name, value in values.items()}, UNKNOWN)
    assert [name for name, _ in topics.heard] == [
        "/joint_states",
        "/aeros/state/tool_position",
        "/aeros/state/human_distance",
        "/aeros/state/holding",
    ]
    assert topics.on("/joint_states")[0].position == (0.5,)
    assert topics.on("/aeros/state/tool_position")[0].point.z == 3.0
    assert missed == []


def test_a_message_equal_to_the_previous_one_is_not_published_again(
    publisher: MessagePublisher, topics: Topics
) -> None:
    for value, time in ((1.0, 1.0), (1.0, 1.0), (1.0, 2.0), (2.0, 2.0), (1.0, 1.0)):
        publisher.publish_state({"human_distance": Reading(value, time)}, UNKNOWN)
    heard = [(one.header.stamp.sec, one.value) for one in topics.on("/aeros/state/human_distance")]
    assert heard == [(1, 1.0), (2, 1.0), (2, 2.0), (1, 1.0)]


def test_transforms_need_a_body_and_the_measured_joints(publisher: MessagePublisher, topics: Topics) -> None:
    angle = {"joint_angle": Reading((0.5,), 1.0)}
    chain = RobotChain(PLAN.body, (1.0, 0.0, 0.0))
    publisher.publish_state(angle, UNKNOWN)
    publisher.publish_state({"holding": Reading(True, 1.0)}, chain)
    assert topics.on("/tf") == []
    publisher.publish_state(angle, chain)
    publisher.publish_state(angle, RobotChain(PLAN.body))
    frames = [
        [(one.header.frame_id, one.child_frame_id) for one in message.transforms]
        for message in topics.on("/tf")
    ]
    joint = ("base", "shoulder_link")
    assert frames == [[("world", "base"), joint], [joint]]
    (fixed,) = topics.on("/tf_static")
    assert [one.child_frame_id for one in fixed.transforms] == ["tool"]
    assert topics.on("/tf")[0].transforms[0].header.stamp.sec == 1


def test_without_a_motion_policy_there_are_no_transforms(site: Site, topics: Topics) -> None:
    publisher = MessagePublisher(topics, site, lambda reason: None)
    publisher.publish_state({"holding": Reading(True, 1.0)}, RobotChain(PLAN.body))
    assert topics.on("/tf") == []


def test_a_message_that_cannot_be_made_is_counted_and_the_others_are_published(
    publisher: MessagePublisher, topics: Topics, missed: list[str]
) -> None:
    publisher.publish_record(b"no record")
    publisher.publish_state({"tool_position": Reading((1.0,), 1.0), "holding": Reading(True, 1.0)}, UNKNOWN)
    assert len(missed) == 2
    assert all(missed)
    assert [name for name, _ in topics.heard] == ["/aeros/state/holding"]


def test_a_failing_bus_is_counted_by_the_name_of_what_it_raised(
    publisher: MessagePublisher, topics: Topics, missed: list[str]
) -> None:
    topics.fails = "/aeros/events"
    publisher.publish_record(DECISION)
    assert missed == ["RuntimeError"]
    topics.fails = "/aeros/state/holding"
    publisher.publish_state({"holding": Reading(True, 1.0), "human_distance": Reading(1.0, 1.0)}, UNKNOWN)
    assert missed == ["RuntimeError"] * 2
    assert [name for name, _ in topics.heard] == ["/aeros/state/human_distance"]


def test_live_listeners_get_the_plants_clock(one_joint: Site, topics: Topics, missed: list[str]) -> None:
    live = MessagePublisher(topics, one_joint, missed.append, is_live=True)
    for time in (1.0, 1.0, 2.5):
        live.publish_state({"human_distance": Reading(1.0, time)}, UNKNOWN)
    assert [(one.clock.sec, one.clock.nanosec) for one in topics.on("/clock")] == [(1, 0), (2, 500_000_000)]
