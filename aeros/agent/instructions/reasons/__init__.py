"""Reasons and statements in instructions, which ask for nothing."""
