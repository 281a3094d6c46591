"""Print check: what a printer would make of a triangle surface, measured against its limits."""
