"""Commands about recorded runs: audit, report and explanation."""
