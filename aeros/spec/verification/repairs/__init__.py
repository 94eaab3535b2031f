"""Repairs of conditions: edits of their text, proved before they are offered."""
