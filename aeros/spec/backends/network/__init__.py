"""Bounds of neural networks in ONNX format: read the graph, propagate boxes, search, ask a verifier."""
