"""The page about a finished run: what was left of it, put in order, drawn, and written as one file."""
