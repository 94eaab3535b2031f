"""Consequences of outcomes on predicates with a definition: true, false, or either."""
