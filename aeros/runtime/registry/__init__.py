"""What is installed on one robot and in which state: proved before it changes, swapped whole."""
