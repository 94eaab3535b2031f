"""Scenes in use, whatever the simulator: start poses, cameras, coatings, conditions, meaning of pictures."""
