"""A folder that one of the processes that run the tests makes, and all take."""

import os


def made_once(tmp_path_factory, name, make):
    """The folder `name`, which `make(folder)` has filled, in this process or in another before."""
    base = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" not in os.environ or os.name == "nt":
        make(base / name)
        return base / name
    import fcntl

    # Of all processes of this run.
    base = base.parent
    done = base / f"{name}.done"
    with (base / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not done.exists():
            make(base / name)
            done.touch()
    return base / name
