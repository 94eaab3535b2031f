"""Quality of service of each topic, as the tools of ROS 2 expect it.

Sources: tf2_ros (`/tf`, `/tf_static`), robot_state_publisher (`/robot_description`),
REP 107 (`/diagnostics`), ClockQoS of rclcpp (`/clock`).
"""

from __future__ import annotations

from typing import Final, NamedTuple


class TopicProfile(NamedTuple):
    """Quality of service of a topic.

    Attributes:
        depth: Number of messages that the publisher keeps for slow readers.
        is_reliable: Messages are sent again until each reader has them; otherwise one may be lost.
        is_latched: Readers that come later get the last messages: transient local.
    """

    depth: int = 10
    is_reliable: bool = True
    is_latched: bool = False


_PROFILES: Final = {
    "/tf": TopicProfile(depth=100),
    "/tf_static": TopicProfile(depth=1, is_latched=True),
    "/clock": TopicProfile(depth=1, is_reliable=False),
    "/robot_description": TopicProfile(depth=1, is_latched=True),
    # Decisions come in bursts, and none may be lost while a reader catches up.
    "/aeros/events": TopicProfile(depth=1_000),
    "/aeros/decisions": TopicProfile(depth=1_000),
}


_OF_ALL_ROBOTS: Final = frozenset({"/tf", "/tf_static", "/clock", "/diagnostics"})
"""Topics that have one name however many robots there are."""


def name_in_namespace(name: str) -> str:
    """Return a name as the node gives it to ROS 2, so that each robot can have a namespace of its own.

    Args:
        name: Absolute name of a topic, service or action.

    Returns:
        The name relative to the node's namespace, which is `/` by default; the same name for topics that all
        robots share.
    """
    return name if name in _OF_ALL_ROBOTS else name.removeprefix("/")


def topic_profile(topic: str, *, is_latched: bool = False) -> TopicProfile:
    """Return the quality of service of a topic.

    Args:
        topic: Absolute name.
        is_latched: The publisher asks that later readers get the last message.

    Returns:
        Its profile.
    """
    profile = _PROFILES.get(topic, TopicProfile())
    return profile._replace(depth=1, is_latched=True) if is_latched else profile
