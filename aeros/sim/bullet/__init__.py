"""PyBullet: the simulated world, the Panda in it, people, scene files and video."""
