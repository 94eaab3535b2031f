"""Topics have the quality of service that the tools of ROS 2 subscribe with."""

from __future__ import annotations

import pytest

from aeros.runtime.bus.ros2.topic_profiles import TopicProfile, name_in_namespace, topic_profile


@pytest.mark.parametrize("topic", ["/tf_static", "/robot_description"])
def test_descriptions_reach_later_readers(topic: str) -> None:
    assert topic_profile(topic) == TopicProfile(depth=1, is_latched=True)


def test_the_clock_is_not_sent_again() -> None:
    assert not topic_profile("/clock").is_reliable


def test_a_burst_of_decisions_waits_for_its_readers() -> None:
    assert topic_profile("/aeros/decisions") == TopicProfile(depth=1_000)


def test_a_publisher_can_ask_for_the_last_message_to_be_kept() -> None:
    assert topic_profile("/aeros/state/x") == TopicProfile()
    assert topic_profile("/aeros/state/x", is_latched=True) == TopicProfile(depth=1, is_latched=True)


def test_names_of_one_robot_are_in_its_namespace_and_shared_ones_are_not() -> None:
    assert name_in_namespace("/aeros/pause") == "aeros/pause"
    assert name_in_namespace("/tf") == "/tf"
