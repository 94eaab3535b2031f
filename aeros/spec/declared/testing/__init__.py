"""Schema of tests of a site."""
