"""The kinematic plant: profiles followed exactly, things moved by geometry alone; no PyBullet."""
