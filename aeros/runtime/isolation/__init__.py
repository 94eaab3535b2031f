"""Untrusted skill code in a process of its own, which can compute, answer, and nothing else."""
