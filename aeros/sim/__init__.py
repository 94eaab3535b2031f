"""Plants: PyBullet physics, declared outcomes, and an in-memory fake."""
