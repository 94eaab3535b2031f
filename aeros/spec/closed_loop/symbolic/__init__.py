"""The agent's loop as a program over sets of states, for loops with too many states to list."""
