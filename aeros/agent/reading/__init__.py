"""Reading of instructions by a language model: goals and plans, checked and compared with the grammar."""
