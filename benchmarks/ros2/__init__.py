"""Benchmark of the robot on ROS 2: `python -m benchmarks.ros2`."""
