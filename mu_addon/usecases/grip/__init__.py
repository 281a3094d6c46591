"""The gripper: its grasp phase by phase, its light signal, and the deviation of its sensor paths."""
