"""Recordings of what is on the bus: ROS 2 bags and MCAP files."""
