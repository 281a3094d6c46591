"""Design by intent: targets and freedoms in, units that meet them out."""
