"""Predictions of each kind of experiment, with every effect of the library."""
