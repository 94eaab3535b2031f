"""Topics for viewers: the scene, the robot's links, what is detected in pictures, quantities and bounds."""
