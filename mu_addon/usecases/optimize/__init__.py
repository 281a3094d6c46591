"""Design by intent: units that meet targets within given freedoms."""
