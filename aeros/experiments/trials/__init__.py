"""Kinds of trials: what many seeds share, the findings of one trial, and what is exact about them."""
