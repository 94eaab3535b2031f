"""Conversion of tasks of IS-Bench to a site, a module and a goal of AEROS."""
