"""Second opinion on a run: every question by another solver, and both encodings at points."""
