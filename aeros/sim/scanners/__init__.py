"""Safety laser scanners: rays in a level plane, their errors, and the distance of people."""
