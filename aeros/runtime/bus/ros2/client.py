"""The only module that imports rclpy: the parts of it that the binding uses.

On a robot rclpy is that of the sourced distribution; from PyPI it comes with the extra `ros2`.
"""

from rclpy import Context, init, shutdown
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import CallbackGroup, MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from rclpy.utilities import get_rmw_implementation_identifier

__all__ = [
    "ActionServer",
    "CallbackGroup",
    "CancelResponse",
    "Context",
    "DurabilityPolicy",
    "Future",
    "GoalResponse",
    "HistoryPolicy",
    "LifecycleNode",
    "MultiThreadedExecutor",
    "MutuallyExclusiveCallbackGroup",
    "Parameter",
    "QoSProfile",
    "ReentrantCallbackGroup",
    "ReliabilityPolicy",
    "SignalHandlerOptions",
    "TransitionCallbackReturn",
    "get_rmw_implementation_identifier",
    "init",
    "shutdown",
]
