"""Architectures that come with AEROS: its own agent, and baselines as published."""
