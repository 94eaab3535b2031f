"""What `aeros mcp` is made of: tools for clients that are not trusted, and the one robot behind them."""
