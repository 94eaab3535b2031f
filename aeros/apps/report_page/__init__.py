"""The HTML page about a finished run: run data, series, plots and diagrams."""
