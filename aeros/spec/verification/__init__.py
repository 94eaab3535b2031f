"""Verification of modules: solving obligations, explaining refutations, certificates and the proof cache."""
