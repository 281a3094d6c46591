"""Files of test machines imported into a unit's measured data."""
