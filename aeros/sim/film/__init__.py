"""Films of runs: a recording of poses, and pictures that are made of it when the run is over."""
