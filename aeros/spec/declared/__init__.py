"""What files say: the closed schemas of site and module manifests."""
