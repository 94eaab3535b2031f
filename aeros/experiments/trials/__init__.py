"""Kinds of trials: what is set up once for many seeds, what one trial finds, and what is exact of it."""
