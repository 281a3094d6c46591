"""Runs of studies in a folder, in this process."""

import json

import attrs

from mu_addon.run.context import RunContext, run_to_end
from mu_addon.run.progress import Progress
from mu_addon.studies.starting import start


def ended(study, folder, report=True):
    """The context of a run that has ended, however it did, and its messages."""
    messages = []
    with run_to_end(Progress([messages.append])) as context:
        context.wants_report = report
        start(study, folder, context)
    return context, messages


def ran(job, folder, status=0):
    """Summary of a run without report and its messages, once it has ended with an exit status."""
    context, messages = ended(attrs.evolve(job, workers=1), folder, report=False)
    assert context.status == status, messages[-1]
    path = folder / "summary.json"
    return json.loads(path.read_text()) if path.is_file() else {}, messages


def executed(job, folder):
    """A study at its end, an `Execution`, and the context of its run."""
    context = RunContext(Progress([]), wants_report=False)
    try:
        return start(attrs.evolve(job, workers=1), folder, context), context
    finally:
        context.unlock()
