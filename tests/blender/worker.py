"""Runs in a Python that has bpy: functions that `session.Blender` asks for, each in a Blender as new."""

import atexit
import importlib
import inspect
import os
import pickle
import shutil
import sys
import traceback

import bpy
import pytest

import mu_addon

from ..costs import processor_time


def renew(registered):
    """Factory settings, an empty file, no files of the user's; the extension out, and in again if asked."""
    mu_addon.unregister()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    shutil.rmtree(os.environ["BLENDER_USER_RESOURCES"], ignore_errors=True)
    if registered:
        mu_addon.register()


KEPT = (
    ("mu_addon.blender.unit.stack", "STACK"),
    ("mu_addon.blender.node_tree.state", "_kept"),
    ("mu_addon.nodes.design_nodes", "STACK"),
)
"""What was computed, kept by its inputs as long as the process lives."""


def forget():
    """Compute anew in each file of tests: some of them count what is computed."""
    for module, name in KEPT:
        found = sys.modules.get(module)
        if found is not None:
            setattr(found, name, type(getattr(found, name))())


def called(module, function, registered, arguments):
    """(traceback or None, what the function returned)."""
    with pytest.MonkeyPatch.context() as patch:
        try:
            if registered is not None:
                renew(registered)
            os.chdir(arguments.pop("folder"))
            wanted = getattr(importlib.import_module(module), function)
            if "monkeypatch" in inspect.signature(wanted).parameters:
                arguments["monkeypatch"] = patch
            return None, wanted(**arguments)
        except BaseException:  # noqa: BLE001 - told to the test, which fails with it
            return traceback.format_exc(), None


def main():
    # Answers go where nothing else is written; what Blender and the tests print goes to the log.
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    last = ""
    while True:
        try:
            order = pickle.load(sys.stdin.buffer)
        except EOFError:
            break
        if order[0] != last:
            forget()
            last = order[0]
        before = processor_time()
        failure, found = called(*order)
        pickle.dump((failure, found, processor_time() - before), answers)
        answers.flush()


if __name__ == "__main__":
    main()
    # The wheel of 4.5 can hang in its own exit handlers, after Python's.
    atexit._run_exitfuncs()
    sys.stdout.flush()
    os._exit(0)
