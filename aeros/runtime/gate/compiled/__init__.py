"""Generated Python for the rules of the gate and the monitor, and for unpacking snapshots."""
