"""Generated Python for the gate's and the monitor's rules, and the snapshots it reads."""
