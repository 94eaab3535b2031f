"""Causal explanations: from the record of a run to the reason for its end."""
