"""Commands about the robot at hand: its modules, operator commands, approvals and memory."""
