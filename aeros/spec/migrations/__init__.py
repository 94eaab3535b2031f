"""Version of every file format, and the steps that rewrite files of older versions."""
