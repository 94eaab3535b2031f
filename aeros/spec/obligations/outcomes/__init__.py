"""Claims about the states in which outcomes leave a robot."""
