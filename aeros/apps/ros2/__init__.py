"""A robot on ROS 2: the node of a run, what it reports of itself, and the goals that it serves."""
