"""Differences between versions of modules or sites: what is newly allowed and newly denied."""
