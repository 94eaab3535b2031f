"""The audit log: hash-chained records, signed checkpoints, keys, and the check of a finished log."""
