"""`--topic-sensor` names a number, a topic and a type; each remark about the node has a line."""

from __future__ import annotations

import argparse
from types import SimpleNamespace

import pytest

from aeros.apps.ros2.robot_bus import RobotBus
from aeros.cli.ros2_options import add_ros2_options, open_peers, print_bus, read_topic_sensor
from aeros.exit_codes import UsageError
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path


@pytest.fixture(scope="module")
def site() -> Site:
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    return site


def test_a_sensor_has_variable_topic_and_type(site: Site) -> None:
    one = read_topic_sensor("human_distance=/scanner/nearest:std_msgs/msg/Float64", site)
    assert (one.variable, one.topic, one.ros) == (
        "human_distance",
        "/scanner/nearest",
        "std_msgs/msg/Float64",
    )
    assert read_topic_sensor("human_distance=/nearest", site).ros == "sensor_msgs/msg/Range"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("human_distanc=/d", "did you mean `human_distance`"),
        ("estop_pressed=/d", "`estop_pressed` is no number of the site"),
        ("human_distance=/d:std_msgs/msg/String", "`std_msgs/msg/String` is none of"),
        ("human_distance=d", "`d` is not an absolute ROS 2 name"),
        ("human_distance", "not an absolute ROS 2 name"),
    ],
)
def test_a_mistake_is_explained(text: str, reason: str, site: Site) -> None:
    with pytest.raises(UsageError, match=reason):
        read_topic_sensor(text, site)


@pytest.mark.parametrize("given", [["--ros-args", "-r", "__ns:=/a"], ["--topic-sensor", "x=/x"]])
def test_options_of_ros_2_need_it(given: list[str]) -> None:
    parser = argparse.ArgumentParser()
    add_ros2_options(parser)
    configuration = argparse.Namespace()
    with pytest.raises(UsageError, match=f"{given[0]} needs --ros2"):
        open_peers(parser.parse_args(given), configuration)  # type: ignore[arg-type]


def test_all_arguments_after_ros_args_are_for_ros_2() -> None:
    parser = argparse.ArgumentParser()
    add_ros2_options(parser)
    parsed = parser.parse_args(["--ros2", "--ros-args", "-r", "__ns:=/a", "--ros2"])
    assert parsed.ros_args == ["-r", "__ns:=/a", "--ros2"]


def test_each_remark_about_the_node_has_a_line(capsys: pytest.CaptureFixture[str]) -> None:
    bus = SimpleNamespace(node_name="/aeros", missing={"tf2_msgs": "not installed", "aeros_msgs": "no"})
    page = SimpleNamespace(command=None)
    robot = RobotBus(bus, None, page, None)  # type: ignore[arg-type]
    print_bus(robot, "waiting for /aeros/pursue")
    first, *remarks = capsys.readouterr().out.splitlines()
    assert first.startswith("ros2       node /aeros, domain ")
    assert first.endswith("; waiting for /aeros/pursue")
    assert remarks == ["           aeros_msgs: no", "           tf2_msgs: not installed"]
