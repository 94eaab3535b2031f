"""Perception: objects and surfaces found in rendered images."""
