"""Keep-out workload and attacks of armguard-mcp, put to AEROS's gate."""
