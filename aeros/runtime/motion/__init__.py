"""Bounds on a stated motion: kinematics, swept volume and derivative bounds, decided before it begins."""
