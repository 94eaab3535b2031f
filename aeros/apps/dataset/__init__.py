"""Datasets of runs in the published layout of LeRobot."""
