"""Each test once more with each further bpy that MU_BPY names; see `session`."""

import subprocess
import sys
import warnings

import pytest

from . import session

if not session.OTHERS:
    warnings.warn("NOT TESTED with bpy 4.5: set MU_BPY to a Python that has it", stacklevel=1)


def _version(python):
    """`bpy 4.5`: what a Python has."""
    script = "import bpy, os; print('version %d.%d' % bpy.app.version[:2], flush=True); os._exit(0)"
    result = subprocess.run([python, "-c", script], capture_output=True, text=True, check=False)
    assert "version " in result.stdout, f"MU_BPY: {python} has no bpy that loads\n{result.stderr}"
    return f"bpy {result.stdout.split('version ')[1].split()[0]}"


@pytest.fixture(
    scope="module",
    params=[sys.executable, *session.OTHERS] if session.OTHERS else None,
    ids=["bpy", *map(_version, session.OTHERS)] if session.OTHERS else None,
)
def each_bpy(request):
    """The Python with bpy that this test runs in: one after another."""
    return getattr(request, "param", sys.executable)
