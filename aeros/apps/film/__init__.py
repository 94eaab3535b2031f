"""Captions of a film, from the audit log, the trace and the samples of a run."""
