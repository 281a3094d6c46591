"""Printability check of a triangle surface against the limits of a printer and its resin."""
