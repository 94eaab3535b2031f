"""Plants: PyBullet physics, kinematic, declared outcomes, and an in-memory fake."""
