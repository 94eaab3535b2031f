"""Elaboration of declared files to the resolved model: names, types and units settle here alone."""
