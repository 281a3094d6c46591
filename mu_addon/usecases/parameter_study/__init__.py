"""Many studies that differ in some of their inputs: the plan, the runs, the table and what it shows."""
