"""The node of a run on ROS 2, with the operator's services and the report of its health."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from aeros.apps.ros2.discovery import default_discovery, reach_text
from aeros.apps.ros2.health import health_message
from aeros.distribution import install_command
from aeros.runtime.bus.feed import BusFeed
from aeros.runtime.bus.messages import DiagnosticArray
from aeros.runtime.bus.operator_services import OperatorRequests, serve_operator_commands
from aeros.runtime.bus.ros2.sensed_plant import SensedPlant
from aeros.runtime.bus.ros2.topic_sensors import TopicSensor
from aeros.runtime.registry.control_page import ControlPage
from aeros.runtime.registry.registry import Registry
from aeros.session.assembly import RecordedPlant
from aeros.session.plant_factory import PlantSetupError
from aeros.spec.model.site import Site

if TYPE_CHECKING:
    from aeros.runtime.bus.ros2.dds_bus import DdsBus

NODE: Final = "aeros"
"""Name of the node, unless `--ros-args` change it."""

_HEALTH_INTERVAL_S: Final = 1.0


class RobotBus:
    """Bus of one robot on ROS 2; `open_robot_bus` makes one.

    Attributes:
        bus: The bus.

    Args:
        bus: The bus.
        requests: Carries out the operator's commands of peers.
        page: The control page of the robot.
        site: Names the robot.
        sensors: Sensors on topics.
    """

    def __init__(
        self,
        bus: DdsBus,
        requests: OperatorRequests,
        page: ControlPage,
        site: Site,
        sensors: Sequence[TopicSensor] = (),
    ) -> None:
        self._sensors = sensors
        self.bus = bus
        self._requests = requests
        self._page = page
        self._site = site
        self._feed: BusFeed | None = None

    @contextmanager
    def serve(self, recorded: RecordedPlant) -> Iterator[None]:
        """Offer the operator's services while the block runs; requests are in the audit record.

        Args:
            recorded: The robot, with its audit log and the feed to this bus.
        """
        self._feed = recorded.live
        self._requests.open_record(
            lambda event, details: recorded.audit.append("note", {"event": event, "details": dict(details)})
        )
        try:
            with serve_operator_commands(self.bus, self._requests):
                yield
        finally:
            self._requests.close_record()

    def with_sensors(self, recorded: RecordedPlant) -> RecordedPlant:
        """Let the sensors on topics measure their variables in place of the plant.

        Args:
            recorded: The robot.

        Returns:
            The robot with these sensors; which they are is in the audit record.
        """
        if not self._sensors:
            return recorded
        named = [{"variable": one.variable, "topic": one.topic, "type": one.ros} for one in self._sensors]
        recorded.audit.append("note", {"event": "topic-sensors", "details": {"sensors": named}})
        return recorded._replace(plant=SensedPlant(recorded.plant, self._sensors))

    def summary(self) -> str:
        """Describe the bus for the summary of a run.

        Returns:
            Node, domain and range.
        """
        return f"node {self.bus.node_name}, {reach_text(os.environ)}"

    def remarks(self) -> Iterator[str]:
        """List what listeners do not get.

        Yields:
            A text for each missing package, and one for lost messages.
        """
        for name, reason in sorted(self.bus.missing.items()):
            yield f"{name}: {reason}"
        if self._feed is not None and self._feed.lost:
            yield f"{self._feed.lost} messages lost: {self._feed.trouble}"

    def report_health(self) -> None:
        """Publish the diagnosis, every second."""
        diagnostics = self.bus.publisher("/diagnostics", DiagnosticArray)

        def publish() -> None:
            feed = self._feed
            diagnostics.publish(
                health_message(
                    self.bus.now(),
                    self._site.id,
                    self._page.command,
                    lost=0 if feed is None else feed.lost,
                    trouble=None if feed is None else feed.trouble,
                    missing=self.bus.missing,
                )
            )

        self.bus.every(_HEALTH_INTERVAL_S, publish)


@contextmanager
def open_robot_bus(
    state: Path,
    site: Site,
    facts: Mapping[str, Any],
    ros_arguments: Sequence[str],
    sensors: Sequence[TopicSensor] = (),
) -> Iterator[RobotBus]:
    """Open the node of a robot; it spins until the block ends.

    Args:
        state: The agent's state folder.
        site: The site in force.
        facts: Read-only parameters of the node.
        ros_arguments: Arguments after `--ros-args`.
        sensors: Sensors on topics.

    Yields:
        The bus.

    Raises:
        PlantSetupError: rclpy is missing or does not start.
    """
    # Before rclpy is imported: the middleware reads the variables when it starts.
    os.environ.update(default_discovery(os.environ))
    try:
        from aeros.runtime.bus.ros2.dds_bus import DdsBus
        from aeros.runtime.bus.ros2.node import Operator, open_node
    except ImportError as error:
        raise PlantSetupError(
            f"--ros2 needs rclpy ({error}): source your ROS 2 distribution, or, to try it, "
            f"{install_command('ros2')}"
        ) from error
    folder = Registry(state).folder
    requests = OperatorRequests(folder)
    with closing(ControlPage(folder)) as page:
        operator = Operator(lambda: page.command, requests.request)
        with ExitStack() as stack:
            try:
                node = stack.enter_context(open_node(NODE, ros_arguments, facts, operator))
            # rclpy has no common class of its errors: arguments, security, the middleware.
            except Exception as error:
                first = str(error).partition("\n")[0]
                raise PlantSetupError(f"ROS 2 does not start: {first}") from error
            robot = RobotBus(DdsBus(node), requests, page, site, sensors)
            robot.report_health()
            for sensor in sensors:
                robot.bus.listen(sensor)
            yield robot
