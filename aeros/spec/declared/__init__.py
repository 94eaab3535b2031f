"""What files say: the closed schemas of manifests, and of site, people, faults and scene files."""
