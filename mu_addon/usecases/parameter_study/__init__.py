"""Parameter studies: many studies that differ in some inputs; plan, runs, table and analysis."""
