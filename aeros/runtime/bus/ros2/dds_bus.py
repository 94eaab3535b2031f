"""Bus over rclpy: topics, services and actions that every ROS 2 process in the domain can use."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final, Generic

import msgspec
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from aeros.runtime.bus.messages import Message, String, Time
from aeros.runtime.bus.port import BusError, F, G, M, Publisher, Q, R, Requester
from aeros.runtime.bus.ros2.action_server import RosActionServer
from aeros.runtime.bus.ros2.node import RobotNode
from aeros.runtime.bus.ros2.ros_types import MissingTypeError, RosConverter, import_interface, interface_of
from aeros.runtime.bus.ros2.topic_profiles import name_in_namespace, topic_profile
from aeros.runtime.bus.ros2.topic_sensors import TopicSensor

OWN_PACKAGE: Final = "aeros_msgs"


class DdsBus:
    """Bus over rclpy; serves, and implements `port.ServingBus`.

    A topic whose message package is not installed carries JSON as `std_msgs/msg/String` on `TOPIC/json` if
    the package is `aeros_msgs`, and is left out otherwise.

    Args:
        node: The node, which spins.

    Attributes:
        missing: For each message package that is not installed, what its names do instead.
    """

    def __init__(self, node: RobotNode) -> None:
        self.missing: dict[str, str] = {}
        self._node = node
        self._converter = RosConverter()
        self._kinds: dict[str, str] = {}

    def publisher(self, topic: str, kind: type[M], *, latched: bool = False) -> Publisher[M]:
        """Implement `PublisherFactory.publisher`."""
        self._register(topic, kind.ros)
        try:
            return self._make_publisher(topic, kind, latched=latched)
        except MissingTypeError as error:
            if error.package != OWN_PACKAGE:
                self.missing[error.package] = "not installed: topics of its types are left out"
                return _NullPublisher()
            self.missing[error.package] = "not installed: topics TOPIC/json have JSON text, no actions"
            return _JsonPublisher(self._make_publisher(f"{topic}/json", String, latched=latched))

    def serve(
        self, service: str, kinds: tuple[type[Q], type[R]], answer: Callable[[Q], R]
    ) -> Callable[[], None]:
        """Implement `ServingBus.serve`; each service answers in a thread that waits for no other."""
        name = interface_of(kinds)
        self._register(service, name)

        def respond(request: Any, _response: Any) -> Any:
            try:
                given = answer(self._converter.from_ros(request, kinds[0]))
            except Exception as error:  # it would end the node's thread, and with it every other service
                self._node.get_logger().error(f"{service}: {error}")
                given = kinds[1]()
            return self._converter.to_ros(given)

        group = MutuallyExclusiveCallbackGroup()
        served = self._node.create_service(
            import_interface(name), name_in_namespace(service), respond, callback_group=group
        )
        return lambda: self._node.destroy_service(served)

    def serve_action(
        self, action: str, kinds: tuple[type[G], type[F], type[R]], *, waiting: int = 10
    ) -> RosActionServer[G, F, R]:
        """Implement `ServingBus.serve_action`."""
        self._register(action, interface_of(kinds))
        return RosActionServer(self._node, action, kinds, self._converter, waiting)

    @property
    def node_name(self) -> str:
        """Full name of the node."""
        return str(self._node.get_fully_qualified_name())

    def missing_for(self, kinds: tuple[type[Message], ...]) -> frozenset[str]:
        """Find the packages that message types need and that are not installed.

        Args:
            kinds: The types.

        Returns:
            Names of packages.
        """
        missing = set()
        for kind in kinds:
            try:
                self._converter.class_of(kind)
            except MissingTypeError as error:
                missing.add(error.package)
        return frozenset(missing)

    def now(self) -> Time:
        """Read the node's clock.

        Returns:
            The time.
        """
        return self._converter.from_ros(self._node.get_clock().now().to_msg(), Time)

    def every(self, seconds: float, call: Callable[[], None]) -> None:
        """Call a function again and again, in a thread of the node, until the node closes.

        Args:
            seconds: Time between calls.
            call: The function.
        """
        self._node.create_timer(seconds, call, callback_group=MutuallyExclusiveCallbackGroup())

    def listen(self, sensor: TopicSensor) -> None:
        """Give the messages of a sensor's topic to the sensor, as fast as they come.

        Args:
            sensor: The sensor.
        """

        def receive(message: Any) -> None:
            now = self.now()
            sensor.receive(message, now.sec + 1e-9 * now.nanosec)

        # Drivers publish as best effort; one who asks for that gets reliable publishers, too.
        quality = QoSProfile(
            history=HistoryPolicy.KEEP_LAST, depth=1, reliability=ReliabilityPolicy.BEST_EFFORT
        )
        self._node.create_subscription(
            import_interface(sensor.ros),
            name_in_namespace(sensor.topic),
            receive,
            quality,
            callback_group=MutuallyExclusiveCallbackGroup(),
        )

    def requesters(self, service: str) -> tuple[Requester, ...]:
        """Implement `ServingBus.requesters`."""
        return self._node.clients_of(name_in_namespace(service))

    def names(self) -> Mapping[str, str]:
        """Implement `ServingBus.names`."""
        return dict(sorted(self._kinds.items()))

    def _register(self, name: str, kind: str) -> None:
        if self._kinds.setdefault(name, kind) != kind:
            raise BusError(f"`{name}` has the type {self._kinds[name]}, not {kind}")

    def _make_publisher(self, topic: str, kind: type[M], *, latched: bool) -> _RosPublisher[M]:
        profile = topic_profile(topic, is_latched=latched)
        quality = QoSProfile(
            history=HistoryPolicy.KEEP_LAST,
            depth=profile.depth,
            reliability=ReliabilityPolicy.RELIABLE if profile.is_reliable else ReliabilityPolicy.BEST_EFFORT,
            durability=DurabilityPolicy.TRANSIENT_LOCAL if profile.is_latched else DurabilityPolicy.VOLATILE,
        )
        made = self._node.create_publisher(self._converter.class_of(kind), name_in_namespace(topic), quality)
        return _RosPublisher(made, self._converter)


class _RosPublisher(Generic[M]):
    def __init__(self, publisher: Any, converter: RosConverter) -> None:
        self._publisher = publisher
        self._converter = converter

    def publish(self, message: M) -> None:
        """Implement `Publisher.publish`."""
        self._publisher.publish(self._converter.to_ros(message))


class _JsonPublisher:
    def __init__(self, publisher: _RosPublisher[String]) -> None:
        self._publisher = publisher

    def publish(self, message: Message) -> None:
        """Implement `Publisher.publish`."""
        self._publisher.publish(String(msgspec.json.encode(message).decode()))


class _NullPublisher:
    def publish(self, message: Message) -> None:
        """Implement `Publisher.publish` for a topic that is left out."""
