"""Reports of a run of experiments: one HTML page and one Markdown file with the same content."""
