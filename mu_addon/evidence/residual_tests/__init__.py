"""Tests of a model's residual against everything it should not depend on, one kind a module."""
