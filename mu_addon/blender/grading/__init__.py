"""Struts graded by hand: a factor on their diameters painted cell by cell."""
