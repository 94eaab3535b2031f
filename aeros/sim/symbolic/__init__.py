"""The symbolic plant: skills have the outcomes that their manifests declare, by seeded chance."""
