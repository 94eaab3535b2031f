"""Viewers get the scene once, the robot once, things as they change, and what pictures showed."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest

from aeros.runtime.bus.message_publisher import RobotChain
from aeros.runtime.bus.viewer.view_publisher import ViewPublisher
from aeros.runtime.ports import CameraPicture, CameraView, PersonFigure, Reading
from aeros.spec.expr.scope import AxisAlignedBox
from aeros.spec.model.site import Site
from tests.unit.runtime.bus.test_message_publisher import Topics
from tests.unit.runtime.bus.viewer.test_things import with_variables
from tests.unit.runtime.one_joint import PLAN, governed

BOX = AxisAlignedBox((Fraction(0),) * 3, (Fraction(1),) * 3)
CUBE = "m.red_cube_position"
VIEW = CameraView((0.0, 0.0, 2.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 60.0)
KNOWN = RobotChain(PLAN.body)
MARKS = "/aeros/camera/top/annotations"


@pytest.fixture
def topics() -> Topics:
    return Topics()


@pytest.fixture
def missed() -> list[str]:
    return []


@pytest.fixture
def publisher(site: Site, topics: Topics, missed: list[str]) -> ViewPublisher:
    whole = replace(governed(with_variables(site), "move"), volumes={"bench": BOX})
    return ViewPublisher(topics, whole, missed.append, {"m.look": ["top"], "m.other": ["side"]})


def picture(time: float) -> CameraPicture:
    return CameraPicture("top", time, 8, 6, bytes(144), None, VIEW)


def labels(topics: Topics) -> list[list[str]]:
    return [[text.text for text in one.texts] for one in topics.on(MARKS)]


def test_there_are_topics_for_what_the_site_has(site: Site, topics: Topics, publisher: ViewPublisher) -> None:
    assert set(topics.kinds) == {
        "/aeros/scene",
        "/aeros/robot",
        "/aeros/things",
        "/aeros/people",
        MARKS,
        "/aeros/bounds/measured/human_distance",
    }
    bare = Topics()
    ViewPublisher(bare, site, lambda _: None, {})
    assert set(bare.kinds) == {"/aeros/people", "/aeros/bounds/measured/human_distance"}


def test_scene_and_robot_are_published_once(topics: Topics, publisher: ViewPublisher) -> None:
    publisher.publish_state({}, KNOWN)
    assert topics.heard == []
    for time in (1.0, 2.0):
        publisher.publish_state({"holding": Reading(True, time)}, KNOWN)
    (scene,), (robot,) = topics.on("/aeros/scene"), topics.on("/aeros/robot")
    assert [one.id for one in scene.entities] == ["bench"]
    assert [one.frame_id for one in robot.entities] == ["shoulder_link"]


def test_a_thing_is_published_when_it_is_measured_anew(topics: Topics, publisher: ViewPublisher) -> None:
    for time in (1.0, 1.0, 2.0):
        publisher.publish_state({CUBE: Reading((0.0, 0.0, 0.0), time)}, KNOWN)
    assert [one.entities[0].timestamp.sec for one in topics.on("/aeros/things")] == [1, 2]


def test_people_are_published_as_they_move_ten_times_a_second(
    topics: Topics, publisher: ViewPublisher
) -> None:
    still, moved = (PersonFigure(x, 0.0, 0.0, 1.75, 0.25) for x in (0.0, 1.0))
    heard = [(0.0, ()), (1.0, (still,)), (2.0, (still,)), (2.05, (moved,)), (2.08, (still, moved))]
    for time, people in heard:
        publisher.publish_people({"holding": Reading(True, time)}, people)
    publisher.publish_people({}, (moved,))
    first, second = topics.on("/aeros/people")
    assert [(one.id, one.timestamp.sec) for one in first.entities] == [("person 1, simulated", 1)]
    assert second.entities[0].cylinders[0].pose.position.x == 1.0
    publisher.publish_people({"holding": Reading(True, 2.15)}, (still, moved))
    assert len(topics.on("/aeros/people")[2].entities) == 2


def test_a_picture_is_marked_with_what_was_found_in_it(topics: Topics, publisher: ViewPublisher) -> None:
    cube, place = Reading((0.0, 0.0, 0.0), 1.0), Reading((0.1, 0.0, 0.0), 1.0)
    publisher.publish_state({CUBE: cube}, KNOWN)
    publisher.publish_picture(picture(1.0))
    # Found by a second perceiver, which takes longer, in the same picture.
    publisher.publish_state({CUBE: cube, "m.push_place": place}, KNOWN)
    # The next picture's values come before the picture, and do not take the marks from the previous one.
    publisher.publish_state({CUBE: cube._replace(time=2.0)}, KNOWN)
    publisher.publish_picture(picture(2.0))
    publisher.publish_picture(picture(3.0))
    assert labels(topics) == [["red cube"], ["red cube", "push place"], ["red cube"], []]


def test_other_cameras_and_bad_values_hide_nothing(
    topics: Topics, publisher: ViewPublisher, missed: list[str]
) -> None:
    publisher.publish_picture(replace(picture(1.0), camera="side"))
    publisher.publish_record(b"no record")
    publisher.publish_state({CUBE: Reading("here", 1.0), "human_distance": Reading(2.0, 1.0)}, KNOWN)
    assert len(missed) == 1
    assert [one.value for one in topics.on("/aeros/bounds/measured/human_distance")] == [2.0]
