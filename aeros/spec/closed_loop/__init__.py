"""The agent's closed loop over a task's predicates: reachable states and exact probabilities."""
