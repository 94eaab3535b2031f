"""The plant `ros2-control`: decided motions as goals of a joint trajectory controller of ros2_control."""
