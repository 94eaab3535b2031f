"""Execution of steps: whose turn it is, each action through the gate to the plant, and the clean-up."""
