"""Results of `aeros verify` as text, JSON, SARIF, JUnit XML and GitHub annotations."""
