"""Verification of modules: obligations discharged by solvers, refutations explained, certificates and the proof cache."""
