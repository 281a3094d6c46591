"""Table I and bending at three scales, and the statements of the paper that they bear on."""
