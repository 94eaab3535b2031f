"""The agent's world model: measured values and conditions over them."""
