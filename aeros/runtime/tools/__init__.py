"""Tools: actions that a service carries out; its answers are readings like those of a sensor."""
