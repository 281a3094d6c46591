"""Import of laboratory files into a folder of measured data."""
