"""Transports of the MCP server: standard input and output, and HTTP on this host."""
