"""Control and data flow of compositions: graphs, arguments of steps, and every path of outcomes."""
