"""Commands that run: one agent on a plant, the gate as a filter, and looking on at a run."""
