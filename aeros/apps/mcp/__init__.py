"""The MCP server: tools for clients that are not trusted, and the one robot behind them."""
