"""The robot, independent of the simulator: kinematics, limits, motion profiles and planned motions."""
