"""Boxes and their narrowing by conditions, the trusted base of UNSAT answers that need no SMT solver."""
