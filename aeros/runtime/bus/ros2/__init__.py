"""Binding of the bus to ROS 2; only `node`, `dds_bus` and `action_server` import rclpy."""
