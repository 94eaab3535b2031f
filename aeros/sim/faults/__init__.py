"""Faults on the physics plant: declared in data, seeded, and acting on bodies, motors or sensors."""
