"""A plant in a process of its own: it outlives the agent that commands it, and stops without one."""
