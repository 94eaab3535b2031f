"""Names of topics, services and actions, by the rules of ROS 2.

Rules: https://design.ros2.org/articles/topic_and_service_names.html. Names here are absolute.
"""

from __future__ import annotations

import re
from typing import Final

_NAME_PART: Final = r"(?!\d)[A-Za-z0-9]+(?:_[A-Za-z0-9]+)*_?|_(?:[A-Za-z0-9]+(?:_[A-Za-z0-9]+)*_?)?"
_ABSOLUTE: Final = re.compile(rf"(?:/(?:{_NAME_PART}))+")


def check_ros_name(name: str) -> str:
    """Check the name of a topic, service or action.

    Args:
        name: absolute name.

    Returns:
        The name.

    Raises:
        ValueError: it is invalid in ROS 2, or not absolute.
    """
    if not _ABSOLUTE.fullmatch(name):
        raise ValueError(
            f"`{name}` is not an absolute ROS 2 name: tokens of letters, digits and single underscores, "
            "none of which begins with a digit, each after a `/`"
        )
    return name
