"""Planning for a goal from the declarations of skills alone: no rules, every declared outcome covered."""
