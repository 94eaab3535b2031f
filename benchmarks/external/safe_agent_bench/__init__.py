"""SafeAgentBench (Yin and others, 2024): demands on time of its long-horizon tasks as rules of a site."""
