"""Simulated plants: physics on PyBullet or MuJoCo, kinematics, declared outcomes and an in-memory fake."""
