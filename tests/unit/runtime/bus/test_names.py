from __future__ import annotations

import string

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.runtime.bus.names import check_ros_name


def is_name(text: str) -> bool:
    """The rules of design.ros2.org, one after the other."""
    if not text.startswith("/") or text.endswith("/") or "//" in text or "__" in text:
        return False
    allowed = set(string.ascii_letters + string.digits + "_/")
    return set(text) <= allowed and not any(part[0] in string.digits for part in text[1:].split("/"))


@given(st.text("aZ0_/ ~é", max_size=8).map(lambda text: f"/{text}") | st.text(max_size=5))
def test_names_are_those_of_ros(text: str) -> None:
    if is_name(text):
        assert check_ros_name(text) == text
    else:
        with pytest.raises(ValueError, match="not an absolute ROS 2 name"):
            check_ros_name(text)


@pytest.mark.parametrize("name", ["/joint_states", "/tf", "/aeros/execute_skill", "/_hidden", "/a_/b1"])
def test_names_in_use_are_names(name: str) -> None:
    assert is_name(name)
    assert check_ros_name(name) == name
