"""Plants for arms at the other end of a wire: a process drives the robot, and the plant plans and watches."""
