"""What must be proved: one file for each group of claims."""
