"""Everything that is declared, and its verification: from YAML text to verdicts and certificates."""
