"""Applications behind the commands: report page, MCP server, watchdog, causal explanations, drawings."""
