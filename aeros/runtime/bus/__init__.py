"""Topics, services and actions with ROS 2 names and message types, through which others follow a run."""
