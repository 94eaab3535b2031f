"""Results of `aeros verify` as text, JSON, SARIF and JUnit XML."""
