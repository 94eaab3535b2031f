"""Skill code: loading, its contract, and skills that run in this process."""
