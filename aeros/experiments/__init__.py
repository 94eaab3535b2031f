"""Seeded trials of execution architectures, compared with exact predictions and the paper."""
