"""Publisher of what viewers show beside the plain measurements: scene, links, detections and bounds."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from math import inf, isnan, nan
from types import MappingProxyType
from typing import Final

from aeros.runtime.bus.change_publisher import ChangePublisher
from aeros.runtime.bus.measurement_messages import motion_joints
from aeros.runtime.bus.message_publisher import RobotChain, count_failures, ros_name
from aeros.runtime.bus.messages import BoundedQuantity, Time, stamp
from aeros.runtime.bus.port import PublisherFactory
from aeros.runtime.bus.viewer.bound_messages import PERIOD, BoundMessages, boundable_quantities
from aeros.runtime.bus.viewer.foxglove_messages import ImageAnnotations, SceneUpdate
from aeros.runtime.bus.viewer.picture_annotations import annotate
from aeros.runtime.bus.viewer.scene_entities import link_entities, person_entity, thing_entity, zone_entities
from aeros.runtime.bus.viewer.things import seen_by, things_of
from aeros.runtime.ports import (
    CameraPicture,
    Hull,
    LinkModel,
    PersonFigure,
    Reading,
    Readings,
    RobotBody,
    Vec3,
)
from aeros.spec.model.site import Site

SCENE: Final = "/aeros/scene"
ROBOT: Final = "/aeros/robot"
THINGS: Final = "/aeros/things"
PEOPLE: Final = "/aeros/people"


class ViewPublisher:
    """Publisher for viewers.

    Args:
        bus: bus to publish on.
        site: declares state variables, volumes and rules.
        missed: called with the reason for each message that cannot be made or published.
        cameras: names of cameras by perceiver; see `cameras_of_perceivers`.
        models: how viewers draw the robot's links, by hull.
    """

    def __init__(
        self,
        bus: PublisherFactory,
        site: Site,
        missed: Callable[[str], None],
        cameras: Mapping[str, Iterable[str]],
        models: Mapping[Hull, LinkModel] = MappingProxyType({}),
    ) -> None:
        self._site, self._missed, self._models = site, missed, models
        self._joints = motion_joints(site)
        self._scene = bus.publisher(SCENE, SceneUpdate, latched=True) if site.volumes else None
        self._robot = bus.publisher(ROBOT, SceneUpdate, latched=True) if self._joints else None
        self._body: RobotBody | None = None
        self._things = things_of(site)
        self._places = bus.publisher(THINGS, SceneUpdate) if self._things else None
        self._found: dict[str, Reading] = {}
        self._people = bus.publisher(PEOPLE, SceneUpdate, latched=True)
        self._figures: tuple[PersonFigure, ...] = ()
        self._people_time = -inf
        """Time of the latest message about people, s."""
        self._seen_by = seen_by(self._things, {name: frozenset(one) for name, one in cameras.items()})
        self._annotations = {
            camera: ChangePublisher(bus.publisher(topic, ImageAnnotations, latched=True))
            for camera in self._seen_by
            if (topic := ros_name(f"/aeros/camera/{camera}/annotations")) is not None
        }
        self._pictures: dict[str, CameraPicture] = {}
        self._detected: dict[str, dict[str, Vec3]] = {}
        """Places of the things that were found in the newest picture of each camera, by variable."""
        self._bounds = BoundMessages(site)
        self._bounded = {
            one.name: bus.publisher(topic, BoundedQuantity)
            for one in boundable_quantities(site)
            if (topic := ros_name(one.topic)) is not None
        }

    def publish_record(self, line: bytes) -> None:
        """Note which actions are under way.

        Args:
            line: line of the audit log.
        """
        with count_failures(self._missed):
            self._bounds.note_record(line)

    def publish_state(self, readings: Readings, chain: RobotChain) -> None:
        """Publish what measurements change in the scene, in pictures, and of bounded quantities.

        Args:
            readings: value (SI) and plant time (s) of each state variable, by name.
            chain: kinematic chain of the robot, and the pose of its base.
        """
        if not readings:
            return
        with count_failures(self._missed):
            self._publish_scene(readings)
        with count_failures(self._missed):
            self._publish_robot(readings, chain.body)
        with count_failures(self._missed):
            if changed := self._publish_things(readings):
                for camera in self._pictures:
                    self._annotate(camera, changed)
        with count_failures(self._missed):
            for name, message in self._bounds.measure(readings):
                if name in self._bounded:
                    self._bounded[name].publish(message)

    def publish_people(self, readings: Readings, people: tuple[PersonFigure, ...]) -> None:
        """Publish where simulated people are, unless they stand still, ten times a second at most.

        Args:
            readings: what was measured at that time.
            people: the people.
        """
        now = max((reading.time for reading in readings.values()), default=nan)
        if people == self._figures or abs(now - self._people_time) < PERIOD or isnan(now):
            return
        self._figures, self._people_time = people, now
        with count_failures(self._missed):
            entities = (person_entity(number, one, stamp(now)) for number, one in enumerate(people, 1))
            self._people.publish(SceneUpdate(entities=tuple(entities)))

    def publish_picture(self, picture: CameraPicture) -> None:
        """Publish what was found in a picture; what is found later is published with the measurements.

        Args:
            picture: the picture.
        """
        if picture.camera in self._annotations:
            self._pictures[picture.camera], self._detected[picture.camera] = picture, {}
            with count_failures(self._missed):
                self._annotate(picture.camera, self._found)

    def _publish_scene(self, readings: Readings) -> None:
        if self._scene is not None:
            scene, self._scene = self._scene, None
            scene.publish(SceneUpdate(entities=zone_entities(self._site, _newest(readings))))

    def _publish_robot(self, readings: Readings, body: RobotBody | None) -> None:
        if self._robot is None or self._joints is None or body is None or body == self._body:
            return
        self._body = body
        self._robot.publish(
            SceneUpdate(entities=link_entities(body, self._joints[1], _newest(readings), self._models))
        )

    def _publish_things(self, readings: Readings) -> Mapping[str, Reading]:
        """Publish the things whose measurement is new, and return the measurements by variable."""
        changed = [
            (one, readings[one.variable])
            for one in self._things
            if one.variable in readings and self._found.get(one.variable) != readings[one.variable]
        ]
        self._found |= {one.variable: reading for one, reading in changed}
        if changed and self._places is not None:
            self._places.publish(SceneUpdate(entities=tuple(thing_entity(*one) for one in changed)))
        return {one.variable: reading for one, reading in changed}

    def _annotate(self, camera: str, readings: Mapping[str, Reading]) -> None:
        """Mark things in the newest picture of a camera; a measurement has the time of its picture."""
        picture, detected = self._pictures[camera], self._detected[camera]
        for one in self._seen_by[camera]:
            reading = readings.get(one.variable)
            if reading is not None and reading.time == picture.time:
                detected[one.variable] = reading.value
        found = [(one, detected[one.variable]) for one in self._seen_by[camera] if one.variable in detected]
        self._annotations[camera].publish(annotate(picture, found))


def _newest(readings: Readings) -> Time:
    return stamp(max(reading.time for reading in readings.values()))
