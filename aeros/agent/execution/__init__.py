"""Execution of a plan: dispatching steps, attempts and retries, progress and journal."""
