"""Node trees of units and of the work on them: kinds of nodes, templates, and the evaluation as a run."""
