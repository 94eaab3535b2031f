"""Isolation of untrusted skill code, in a process that can compute and answer, and nothing else."""
