"""Sentences of an instruction: their words, other words for the same, and their segments."""
