"""Recovery after a crash: checkpoints, quarantine, and steps that may already have run."""
