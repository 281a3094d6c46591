"""Use cases: one folder a job, with its inputs, its stages, its report and its charts."""
