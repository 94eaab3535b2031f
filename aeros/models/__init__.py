"""Models that skill code evaluates: networks, tables and files, behind an interface that is checked."""
