"""Closed schemas of the files that people write: manifests, and site, people, faults and scene files."""
