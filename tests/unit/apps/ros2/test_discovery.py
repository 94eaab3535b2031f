"""Nobody outside this machine finds the node, unless the environment asks for that."""

from __future__ import annotations

import pytest

from aeros.apps.ros2.discovery import default_discovery, reach_text


def test_by_default_the_range_is_this_machine() -> None:
    set_here = default_discovery({})
    assert set_here == {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    assert reach_text(set_here) == "domain 0, this machine only"


def test_humble_has_another_variable() -> None:
    set_here = default_discovery({"ROS_DISTRO": "humble"})
    assert set_here == {"ROS_LOCALHOST_ONLY": "1"}
    assert reach_text({**set_here, "ROS_DOMAIN_ID": "7"}) == "domain 7, this machine only"


@pytest.mark.parametrize(
    ("variable", "value"),
    [
        ("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET"),
        ("ROS_DISCOVERY_SERVER", "robot:11811"),
        ("ROS_STATIC_PEERS", "robot"),
        ("ROS_LOCALHOST_ONLY", "0"),
    ],
)
def test_a_choice_of_the_environment_is_kept(variable: str, value: str) -> None:
    assert default_discovery({variable: value}) == {}
    assert reach_text({variable: value}) == "domain 0, other machines too"
