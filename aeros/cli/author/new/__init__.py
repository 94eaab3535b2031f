"""Templates of modules, sites and projects: `aeros new`."""
