"""Where the things of a scene are at the start, and what follows from where they are: no simulator."""
