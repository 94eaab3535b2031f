"""The command line: arguments, calls and exit codes.  The only package that wires all layers together."""
