"""Where to thread the waveguide: candidates, inclusions, deviation from the baseline, ranking."""
