"""Perception at run time: perceivers of modules in their workers, and a plant that measures with them."""
