"""Simulated plants: PyBullet physics, kinematics, declared outcomes and an in-memory fake."""
