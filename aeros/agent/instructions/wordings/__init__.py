"""Wordings that ask for the same as a plain imperative, one file for each class of English."""
