"""The agent's memory: episodes, facts and success rates in one SQLite file."""
