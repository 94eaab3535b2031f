"""Scenes with physics, built from scene files."""
