"""Manual grading of struts: a factor on their diameters painted cell by cell."""
