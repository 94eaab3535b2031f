"""The kinematic plant: profiles are followed exactly, objects move by geometry alone; no PyBullet."""
