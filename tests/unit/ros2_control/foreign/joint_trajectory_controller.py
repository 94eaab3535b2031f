"""A joint trajectory controller and a joint state broadcaster, as far as a client of theirs sees them.

It behaves as `joint_trajectory_controller` of ros2_controllers does with a position interface. It rejects
goals of other joints, without points, whose times do not increase, that end in the past or in motion. A new
goal preempts the old one, which ends as aborted with the code for an invalid goal. A trajectory starts at its
header's stamp, and leads from the measured state to its first point to come. Errors beyond the tolerances end
the goal, and the joints are held where they are; so they are after a cancellation.
Source: joint_trajectory_controller.cpp, ros-controls/ros2_controllers, branch master, 2026.

The argument is a JSON object: `joints`, `start`, `log` (a file; one line for each event), and faults:
`inactive`, `rate` (Hz), `lag` (s of the simulated motors), `no_speeds`, `stall_after`, `silent_after`,
`mute_after` (goals are neither answered nor ended), `exit_after` (s since the first goal began),
`sag` (rad by which the last joint misses the goal). With `busy`, another client's goal is under way from the
start, and lasts so many seconds.
"""

import json
import os
import sys

import rclpy
from control_msgs.action import FollowJointTrajectory
from rclpy.action import ActionClient, ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

Result = FollowJointTrajectory.Result


def seconds(stamp):
    return stamp.sec + 1e-9 * stamp.nanosec


def quintic(begin, end, lasts, at):
    """Position and speed between two points with position, speed and acceleration."""
    if lasts <= 0.0:
        return end[0], end[1]
    (p0, v0, a0), (p1, v1, a1), t = begin, end, lasts
    c = [
        p0,
        v0,
        a0 / 2,
        (20 * (p1 - p0) - (8 * v1 + 12 * v0) * t - (3 * a0 - a1) * t * t) / (2 * t**3),
        (30 * (p0 - p1) + (14 * v1 + 16 * v0) * t + (3 * a0 - 2 * a1) * t * t) / (2 * t**4),
        (12 * (p1 - p0) - (6 * v1 + 6 * v0) * t - (a0 - a1) * t * t) / (2 * t**5),
    ]
    return sum(k * at**n for n, k in enumerate(c)), sum(n * k * at ** (n - 1) for n, k in enumerate(c) if n)


class Goal:
    def __init__(self, handle):
        self.handle = handle
        self.done = Future()

    def end(self, how, code=0, text=""):
        getattr(self.handle, how)()
        self.done.set_result(Result(error_code=code, error_string=text))


class Controller:
    def __init__(self, options):
        self.options = options
        self.joints = options["joints"]
        self.node = rclpy.create_node("joint_trajectory_controller")
        self.node.declare_parameter("joints", self.joints)
        self.q = list(options["start"])
        self.dq = [0.0] * len(self.q)
        self.desired = list(self.q)
        self.goal = None
        self.points = None  # (time, [(p, v, a) of each joint]), on the node's clock
        self.tolerances = None
        self.began = None
        self.updated = self.now()
        self.log = open(options["log"], "a", buffering=1)  # noqa: SIM115
        self.states = self.node.create_publisher(JointState, "/joint_states", 10)
        self.server = ActionServer(
            self.node,
            FollowJointTrajectory,
            "~/follow_joint_trajectory",
            execute_callback=self.execute,
            goal_callback=self.judge,
            handle_accepted_callback=self.accept,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            callback_group=ReentrantCallbackGroup(),
        )
        self.goals = {}
        self.period = 1.0 / options.get("rate", 100.0)
        self.node.create_timer(self.period, self.update)

    def send_own_goal(self):
        """Send a goal as another client does."""
        client = ActionClient(self.node, FollowJointTrajectory, "~/follow_joint_trajectory")
        point = JointTrajectoryPoint(positions=self.q)
        point.time_from_start.sec = int(self.options["busy"])
        goal = FollowJointTrajectory.Goal()
        goal.trajectory = JointTrajectory(joint_names=self.joints, points=[point])
        client.send_goal_async(goal)
        return client

    def now(self):
        return self.node.get_clock().now().nanoseconds * 1e-9

    def write(self, event, **more):
        self.log.write(json.dumps({"event": event, "time": self.now(), **more}) + "\n")

    def fault(self, name):
        after = self.options.get(name)
        return after is not None and self.began is not None and self.now() - self.began >= after

    def judge(self, request):
        trajectory = request.trajectory
        why = None
        times = [seconds(point.time_from_start) for point in trajectory.points]
        if self.options.get("inactive"):
            why = "not running"
        elif sorted(trajectory.joint_names) != sorted(self.joints):
            why = "joints"
        elif not times:
            why = "empty"
        elif any(b <= a for a, b in zip(times, times[1:])):
            why = "times"
        elif any(abs(v) > 1e-7 for v in trajectory.points[-1].velocities):
            why = "velocity at the end"
        elif any(len(one.positions) != len(trajectory.joint_names) for one in trajectory.points):
            why = "positions"
        elif seconds(trajectory.header.stamp) and seconds(trajectory.header.stamp) + times[-1] < self.now():
            why = "past"
        self.write("received", refused=why, joints=list(trajectory.joint_names), count=len(times))
        return GoalResponse.REJECT if why else GoalResponse.ACCEPT

    def accept(self, handle):
        old, self.goal = self.goal, Goal(handle)
        handle.execute()
        self.goals[bytes(handle.goal_id.uuid)] = self.goal
        if old is not None:
            self.write("preempted")
            old.end("abort", Result.INVALID_GOAL, "Current goal preempted by new incoming action.")
        self.begin(handle.request)

    def begin(self, request):
        trajectory, now = request.trajectory, self.now()
        order = [trajectory.joint_names.index(name) for name in self.joints]
        start = seconds(trajectory.header.stamp) or now
        before = [(p, v, 0.0) for p, v in zip(self.q, self.dq)]
        self.points = [(now, before)]
        for point in trajectory.points:
            at = start + seconds(point.time_from_start)
            if at > now:
                values = [
                    (
                        point.positions[place],
                        point.velocities[place] if point.velocities else 0.0,
                        point.accelerations[place] if point.accelerations else 0.0,
                    )
                    for place in order
                ]
                self.points.append((at, values))
        if self.options.get("sag"):
            self.sag = self.options["sag"]
        path = {one.name: one.position for one in request.path_tolerance}
        ends = {one.name: one.position for one in request.goal_tolerance}
        self.tolerances = (
            [path.get(name, 0.0) for name in self.joints],
            [ends.get(name, 0.0) for name in self.joints],
            seconds(request.goal_time_tolerance),
        )
        if self.began is None:
            self.began = start
        self.write(
            "accepted",
            start=start,
            first=list(trajectory.points[0].positions),
            last=list(trajectory.points[-1].positions),
            lasts=seconds(trajectory.points[-1].time_from_start),
            path_tolerance=self.tolerances[0],
        )

    async def execute(self, handle):
        key = bytes(handle.goal_id.uuid)
        result = await self.goals[key].done
        del self.goals[key]
        return result

    def hold(self):
        self.points = None
        self.desired = list(self.q)

    def sample(self, now):
        """Desired positions; True if the last point is past."""
        last, values = self.points[-1]
        if now >= last:
            return [p for p, _, _ in values], True
        place = max(n for n, (at, _) in enumerate(self.points) if at <= now or n == 0)
        (t0, begin), (t1, end) = self.points[place], self.points[place + 1]
        return [quintic(a, b, t1 - t0, now - t0)[0] for a, b in zip(begin, end)], False

    def update(self):
        now = self.now()
        if self.fault("exit_after"):
            self.write("exit")
            os._exit(1)
        lasts, self.updated = now - self.updated, now
        over = False
        if self.goal is not None and self.goal.handle.is_cancel_requested:
            self.write("cancelled")
            self.goal.end("canceled")
            self.goal = None
            self.hold()
        if self.points is not None:
            self.desired, over = self.sample(now)
        self.move(lasts)
        if self.goal is not None and not self.fault("mute_after"):
            self.check(now, over)
        if not self.fault("silent_after"):
            self.publish()

    def move(self, lasts):
        lag = self.options.get("lag", 0.005)
        share = 1.0 if lag <= 0.0 else min(1.0, lasts / (lasts + lag))
        stalled = self.fault("stall_after")
        sag = self.options.get("sag", 0.0) if self.points is not None else 0.0
        for n, target in enumerate(self.desired):
            aim = target + (sag if n == len(self.desired) - 1 else 0.0)
            new = self.q[n] if stalled else self.q[n] + share * (aim - self.q[n])
            self.dq[n] = (new - self.q[n]) / lasts if lasts > 0.0 else 0.0
            self.q[n] = new

    def check(self, now, over):
        path, ends, patience = self.tolerances
        errors = [abs(a - b) for a, b in zip(self.desired, self.q)]
        if not over:
            if any(tolerance > 0.0 and error > tolerance for error, tolerance in zip(errors, path)):
                self.finish(
                    "abort", Result.PATH_TOLERANCE_VIOLATED, "Aborted due to path tolerance violation"
                )
                self.hold()
        elif all(tolerance <= 0.0 or error <= tolerance for error, tolerance in zip(errors, ends)):
            self.finish("succeed", Result.SUCCESSFUL, "Goal successfully reached!")
        elif now - self.points[-1][0] > patience:
            late = f"Aborted due to goal_time_tolerance exceeding by {now - self.points[-1][0]:f} seconds"
            self.finish("abort", Result.GOAL_TOLERANCE_VIOLATED, late)
            self.hold()

    def finish(self, how, code, text):
        self.write("ended", code=code, q=self.q)
        goal, self.goal = self.goal, None
        goal.end(how, code, text)

    def publish(self):
        message = JointState()
        message.header.stamp = self.node.get_clock().now().to_msg()
        # As a broadcaster does: in an order of its own, with joints of others.
        message.name = [*reversed(self.joints), "finger_joint1"]
        message.position = [*reversed(self.q), 0.0]
        if not self.options.get("no_speeds"):
            message.velocity = [*reversed(self.dq), 0.0]
        self.states.publish(message)


if __name__ == "__main__":
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    controller = Controller(json.loads(sys.argv[1]))
    executor = SingleThreadedExecutor()
    executor.add_node(controller.node)
    if controller.options.get("busy"):
        client = controller.send_own_goal()
        while controller.goal is None:
            executor.spin_once(0.1)
    print("ready", flush=True)
    executor.spin()
