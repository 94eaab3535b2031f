"""The one persistent agent: it observes, plans, proposes and remembers; it cannot act."""
