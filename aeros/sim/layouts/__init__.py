"""Scenes in use, whatever the simulator: start poses, cameras, coatings and conditions."""
