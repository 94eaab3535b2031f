"""Commands that run: one agent on a plant, the gate as a filter, and a live view of a run."""
