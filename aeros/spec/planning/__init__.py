"""Plans for a goal from what skills declare alone: no rules, every declared outcome provided for."""
