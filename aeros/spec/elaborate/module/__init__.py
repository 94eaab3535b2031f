"""Elaboration of modules: skills, compositions, tasks and models, with names resolved under a site."""
