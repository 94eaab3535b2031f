"""Understanding of instructions: English words to an ordered list of tasks, or a refusal that says why."""
