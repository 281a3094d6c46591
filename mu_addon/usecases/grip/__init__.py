"""The gripper at work: a grasp phase by phase, what its light tells, and its sensor paths' deviation."""
