"""From a scene file to a `Scene`: units converted, names resolved, files included, faults reported."""
