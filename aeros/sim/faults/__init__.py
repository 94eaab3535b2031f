"""Faults: what goes wrong on the physics plant, declared in data, seeded, and physical or in a sensor."""
