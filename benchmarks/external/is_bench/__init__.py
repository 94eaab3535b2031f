"""IS-Bench (Lu and others, 2025): household tasks with machine-readable safety conditions."""
