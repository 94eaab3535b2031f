"""Composition graphs at work: their edges, and every path of outcomes through them."""
