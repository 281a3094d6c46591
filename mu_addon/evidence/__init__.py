"""Measured data against the model: what is wrong, why, and what mending it gains."""
