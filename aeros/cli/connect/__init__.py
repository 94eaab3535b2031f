"""Commands that connect AEROS with other programs."""
