"""Audit records: their encoding as canonical JSON, and replay of a log against the gate."""
