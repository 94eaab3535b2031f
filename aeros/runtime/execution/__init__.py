"""Execution of skills: scheduling, one step's way from request to motor, clean-up."""
