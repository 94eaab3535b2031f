"""Binding of the bus to ROS 2 over rclpy; only `node`, `dds_bus` and `action_server` import rclpy."""
