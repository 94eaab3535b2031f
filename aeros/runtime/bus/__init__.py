"""Topics, services and actions with ROS 2 names and message shapes: what others may hear of a run."""
