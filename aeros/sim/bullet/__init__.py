"""PyBullet: the simulated world, robots in it, people, scene files and video."""
