"""One look of a module's perceivers at a simulated scene, for `aeros look`."""
