"""The agent's loop on a task's predicates: what can happen in it, and how likely."""
