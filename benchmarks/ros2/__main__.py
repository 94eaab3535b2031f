"""Latency of services and cost of publishing on ROS 2, beside a node of rclpy that does nothing else.

Run by a Python with the extra `ros2` and `aeros ros2-messages`:

    python -m benchmarks.ros2

Each measurement is repeated with a node of rclpy alone: a service that answers at once, a message that is
ready. Calls and messages go to another process on this machine. A resume is recorded durably before it is
answered; to ask for the node's state is not recorded.
"""

from __future__ import annotations

import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.command import build_parser, print_json

_ECMS = Path(__file__).parents[2] / "ecms"

_BARE_SERVER = """
import rclpy
from std_srvs.srv import Trigger
rclpy.init()
node = rclpy.create_node("bare")
def answer(request, response):
    response.success = True
    return response
node.create_service(Trigger, "/bare/resume", answer)
rclpy.spin(node)
"""

_LISTENER = """
import rclpy
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage
from aeros_msgs.msg import Decision
rclpy.init()
node = rclpy.create_node("listener")
for kind, topic in ((JointState, "/joint_states"), (TFMessage, "/tf"), (Decision, "/aeros/decisions")):
    node.create_subscription(kind, topic, lambda message: None, 10)
rclpy.spin(node)
"""


@contextmanager
def _process(*command: str) -> Iterator[None]:
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield
    finally:
        process.terminate()
        process.wait()


def _percentiles(times: list[float]) -> dict[str, float]:
    ordered = sorted(times)
    return {f"p{part}": 1e6 * ordered[min(len(ordered) - 1, len(ordered) * part // 100)] for part in (50, 99)}


def _call_times(service: str, ros: str, count: int) -> dict[str, float]:
    """Latencies of calls, one after the other, in microseconds."""
    import rclpy

    from aeros.runtime.bus.ros2.ros_types import import_interface

    kind = import_interface(ros)
    rclpy.init()
    node = rclpy.create_node("caller")
    client = node.create_client(kind, service)
    if not client.wait_for_service(timeout_sec=60.0):
        raise SystemExit(f"nobody offers {service}")
    times = []
    for _ in range(count):
        began = time.perf_counter()
        rclpy.spin_until_future_complete(node, client.call_async(kind.Request()))
        times.append(time.perf_counter() - began)
    node.destroy_node()
    rclpy.shutdown()
    return _percentiles(times)


def _publish_times(count: int) -> dict[str, dict[str, dict[str, float]]]:
    """Costs of publishing with one listener, in microseconds: message and conversion, and rclpy alone."""
    import rclpy

    from aeros.runtime.bus.messages import (
        DecisionMessage,
        Header,
        JointState,
        Message,
        TFMessage,
        Time,
        TransformStamped,
    )
    from aeros.runtime.bus.ros2.dds_bus import DdsBus
    from aeros.runtime.bus.ros2.node import Operator, open_node
    from aeros.runtime.bus.ros2.ros_types import RosConverter
    from aeros.runtime.execution.governor import OperatorCommand

    messages: dict[str, Message] = {
        "/joint_states": JointState(Header(Time(1)), ("a",) * 7, (0.5,) * 7, (0.5,) * 7, (0.5,) * 7),
        "/tf": TFMessage((TransformStamped(Header(Time(1), "a"), "b"),) * 8),
        "/aeros/decisions": DecisionMessage(Time(1), 1, "module", "skill", "ALLOW", "{}" * 100, "[]"),
    }
    found: dict[str, dict[str, dict[str, float]]] = {name: {} for name in messages}
    operator = Operator(lambda: OperatorCommand.RUN, lambda *_: None)
    with open_node("publisher", [], {}, operator) as node:
        bus = DdsBus(node)
        for name, message in messages.items():
            publisher = bus.publisher(name, type(message))
            time.sleep(1.0)  # until the listener has found it
            found[name]["aeros"] = _repeat(partial(publisher.publish, message), count)
    rclpy.init()
    bare = rclpy.create_node("bare_publisher")
    for name, message in messages.items():
        ready = RosConverter().to_ros(message)
        publisher = bare.create_publisher(type(ready), name, 10)
        time.sleep(1.0)
        found[name]["rclpy"] = _repeat(partial(publisher.publish, ready), count)
    bare.destroy_node()
    rclpy.shutdown()
    return found


def _repeat(call: Callable[[], object], count: int) -> dict[str, float]:
    times = []
    for _ in range(count):
        began = time.perf_counter()
        call()
        times.append(time.perf_counter() - began)
        time.sleep(0.0005)
    return _percentiles(times)


def measure(*, is_quick: bool) -> dict[str, Any]:
    """Measure services and publishing.

    Args:
        is_quick: True for few repetitions.

    Returns:
        Microseconds, by what was measured.
    """
    count = 20 if is_quick else 1_000
    with _process(sys.executable, "-c", _BARE_SERVER):
        bare = _call_times("/bare/resume", "std_srvs/srv/Trigger", count)
    with tempfile.TemporaryDirectory() as work:
        options = ("--plant", "kinematic", "--ecms", str(_ECMS), "--ros2")
        folders = ("--state", f"{work}/state", "--out", f"{work}/out")
        with _process(sys.executable, "-m", "aeros", "serve", "fetch the object", *options, *folders):
            recorded = _call_times("/aeros/resume", "std_srvs/srv/Trigger", count)
            state = _call_times("/aeros/get_state", "lifecycle_msgs/srv/GetState", count)
    with _process(sys.executable, "-c", _LISTENER):
        published = _publish_times(count)
    where = f"{platform.platform()}, Python {platform.python_version()}, load {os.getloadavg()[0]:.1f}"
    services = {
        "/aeros/resume": {"rclpy": bare, "aeros": recorded},
        "/aeros/get_state": {"rclpy": bare, "aeros": state},
    }
    return {"machine": where, "services": services, "publish": published}


def main() -> None:
    """Print the measurements."""
    arguments = build_parser(__doc__, "few repetitions").parse_args()
    found = measure(is_quick=arguments.quick)
    if arguments.format == "json":
        print_json(found)
        return
    print(found["machine"])
    print("microseconds       aeros p50  p99     rclpy p50  p99")
    for name, row in {**found["services"], **found["publish"]}.items():
        ours, bare = row["aeros"], row["rclpy"]
        print(f"{name:<18} {ours['p50']:>8.0f} {ours['p99']:>7.0f} {bare['p50']:>8.0f} {bare['p99']:>7.0f}")


if __name__ == "__main__":
    main()
