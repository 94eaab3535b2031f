"""Drawings of graphs as Mermaid, DOT or SVG."""
