"""Schema of robot files."""
