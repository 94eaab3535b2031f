"""The watchdog: keeps an agent at its task and restarts it after a crash."""
