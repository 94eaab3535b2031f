"""`aeros test`: tests of a site and its modules, from the file to the report."""
