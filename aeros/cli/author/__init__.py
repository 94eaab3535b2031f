"""Commands for authors of modules and sites: verify, plan, graph, predict, compare, create."""
