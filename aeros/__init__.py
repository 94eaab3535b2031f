"""AEROS: capability packages proved safe before installation, actions decided safe before motion."""

__version__ = "0.1.0"
