"""Obligations: the claims to prove of sites, modules and their configuration, one file for each group."""
