"""The command line: arguments → calls → exit code.  The only place that wires the layers together."""
