"""What a run of experiments leaves for people: one HTML page and one Markdown file, of the same content."""
