"""From files of a laboratory to a folder of measured data."""
