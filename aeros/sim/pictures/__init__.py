"""Pictures without a physics engine: solids of a scene and of the robot, and the rays that meet them."""
