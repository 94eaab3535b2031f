"""Initial positions in each scene and the measurements that follow from positions, without a simulator."""
