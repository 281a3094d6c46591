"""Node trees of units and of jobs on them: kinds of nodes, templates, and the evaluation as a run."""
