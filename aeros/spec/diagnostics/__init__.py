"""Diagnostics: codes, source spans, error families and their rendering for people."""
