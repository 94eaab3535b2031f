"""The page of a run while it is under way: the report's page, made anew and served on this host."""
