"""The paper's table and bending ranges, done again beside its printed numbers."""
