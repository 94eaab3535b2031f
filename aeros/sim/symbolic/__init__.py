"""The symbolic plant: skills end with the outcomes that their manifests declare, drawn by seed."""
