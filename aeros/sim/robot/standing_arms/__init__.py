"""Further arms on a robot's body, which stand while one arm moves."""
