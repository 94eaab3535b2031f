"""Scenes without physics, built from scene files."""
