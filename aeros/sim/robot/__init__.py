"""The robot whatever simulates it: kinematics, limits, motion profiles and planned motions."""
