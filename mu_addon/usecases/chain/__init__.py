"""Units in series: their joints, their motion under pressures or to a point, a report."""
