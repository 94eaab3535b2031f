"""A ROS 2 process that has no AEROS: does what its arguments say and prints each result as a line of JSON.

Each argument is a JSON object with the key `do`.  Run by a Python that has rclpy and the message packages.
"""

import json
import sys
import time
from importlib import import_module

import rclpy
from rclpy.action import ActionClient
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

NODE = "peer"


def interface(name):
    package, kind, one = name.split("/")
    return getattr(import_module(f"{package}.{kind}"), one)


def plain(value):
    """A ROS 2 message as plain JSON values."""
    if hasattr(value, "get_fields_and_field_types"):
        return {name: plain(getattr(value, name)) for name in value.get_fields_and_field_types()}
    if isinstance(value, bytes):
        return list(value)
    if isinstance(value, str | int | float | bool):
        return value
    return [plain(one) for one in value]


def filled(kind, values):
    """A message with these values; nested messages as objects."""
    made = kind()
    for name, value in values.items():
        if isinstance(value, dict):
            value = filled(type(getattr(made, name)), value)
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            package, one = kind.get_fields_and_field_types()[name][len("sequence<") : -1].split("/")
            value = [filled(interface(f"{package}/msg/{one}"), each) for each in value]
        setattr(made, name, value)
    return made


class Peer:
    def __init__(self):
        rclpy.init()
        self.node = rclpy.create_node(NODE)
        self.heard = {}
        self.spins = 0

    def wait(self, future, seconds=90.0):
        rclpy.spin_until_future_complete(self.node, future, timeout_sec=seconds)
        if not future.done():
            raise TimeoutError("no answer")
        return future.result()

    def spin(self, seconds):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            rclpy.spin_once(self.node, timeout_sec=0.05)

    def call(self, service, type, request=None, times=1):
        kind = interface(type)
        client = self.node.create_client(kind, service)
        if not client.wait_for_service(timeout_sec=60.0):
            raise TimeoutError(f"nobody offers {service}")
        taken = []
        for _ in range(times):
            began = time.perf_counter()
            answer = self.wait(client.call_async(filled(kind.Request, request or {})))
            taken.append(time.perf_counter() - began)
        self.node.destroy_client(client)
        return {"answer": plain(answer), "seconds": taken}

    def goal(self, action, type, goal, cancel_after=None):
        kind = interface(type)
        client = ActionClient(self.node, kind, action)
        if not client.wait_for_server(timeout_sec=60.0):
            raise TimeoutError(f"nobody offers {action}")
        feedback = []
        asked = client.send_goal_async(
            filled(kind.Goal, goal), feedback_callback=lambda one: feedback.append(plain(one.feedback))
        )
        handle = self.wait(asked)
        if not handle.accepted:
            return {"accepted": False}
        result = handle.get_result_async()
        if cancel_after is not None:
            self.spin(cancel_after)
            self.wait(handle.cancel_goal_async())
        end = self.wait(result)
        client.destroy()
        return {
            "accepted": True,
            "status": end.status,
            "result": plain(end.result),
            "feedback": feedback,
        }

    def subscribe(self, topic, type, depth=1000, latched=False, reliable=True):
        quality = QoSProfile(
            depth=depth,
            durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
            reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        )
        got = self.heard.setdefault(topic, [])
        self.node.create_subscription(interface(type), topic, lambda one: got.append(plain(one)), quality)
        return {}

    def listen(self, seconds, until=None):
        """Listen for some seconds, or until some text is in a message of any topic."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            rclpy.spin_once(self.node, timeout_sec=0.05)
            if until is not None and any(until in json.dumps(got[-3:]) for got in self.heard.values()):
                self.spin(0.5)
                break
        return {
            topic: {"count": len(got), "last": got[-1] if got else None} for topic, got in self.heard.items()
        }

    def topics(self):
        self.spin(0.5)
        found = {}
        for topic, _ in self.node.get_topic_names_and_types():
            for one in self.node.get_publishers_info_by_topic(topic):
                found[topic] = {
                    "type": one.topic_type,
                    "hash": str(one.topic_type_hash),
                    "durability": one.qos_profile.durability.name,
                    "reliability": one.qos_profile.reliability.name,
                }
        return found

    def services(self):
        self.spin(0.5)
        return {name: kinds[0] for name, kinds in self.node.get_service_names_and_types()}

    def wait_for(self, service, type):
        client = self.node.create_client(interface(type), service)
        found = client.wait_for_service(timeout_sec=60.0)
        self.node.destroy_client(client)
        return found

    def publish_range(self, topic, value, rate, seconds):
        """Publish a distance at a rate."""
        kind = interface("sensor_msgs/msg/Range")
        publisher = self.node.create_publisher(kind, topic, 10)
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            message = kind(min_range=0.05, max_range=20.0, range=value)
            message.header.stamp = self.node.get_clock().now().to_msg()
            publisher.publish(message)
            time.sleep(1.0 / rate)
        self.node.destroy_publisher(publisher)
        return {}

    def flood(self, service, type, count):
        """Send requests without waiting for answers."""
        kind = interface(type)
        client = self.node.create_client(kind, service)
        client.wait_for_service(timeout_sec=60.0)
        for _ in range(count):
            client.call_async(kind.Request())
        self.spin(0.2)
        return count


def main():
    peer = Peer()
    for argument in sys.argv[1:]:
        wanted = json.loads(argument)
        print(json.dumps(getattr(peer, wanted.pop("do"))(**wanted)), flush=True)
    peer.node.destroy_node()
    rclpy.shutdown()


main()
