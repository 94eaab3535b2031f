"""Resolved model of a site and its modules: the values that obligations, gate and agent compute with."""
