"""MuJoCo as engine of the physics plant."""
