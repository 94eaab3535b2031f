"""The command `aeros top`: a view of a run in another terminal, with keys to pause and stop the robot."""
