"""Text files as data: YAML with the place of every value, digests, decoding into declared records."""
