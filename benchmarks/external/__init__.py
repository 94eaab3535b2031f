"""Benchmarks that other people published, run on AEROS."""
