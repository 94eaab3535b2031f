"""PyBullet: the simulated world, robots in it, people and scene files."""
