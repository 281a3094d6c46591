"""A simulation that misbehaves on request: `fake_worker.py HOW`."""

import json
import os
import signal
import sys
import time


def emit(**message):
    print(json.dumps(message), flush=True)


def progress(fraction):
    emit(type="progress", stage="Model A", state="run", fraction=fraction, seconds=1.0, seconds_left=3.0)


def good():
    progress(0.25)
    emit(type="warning", what="a small thing", where="", what_to_do="")
    progress(0.75)
    emit(type="result", summary={})


def reported_error():
    progress(0.5)
    emit(type="error", what="no equilibrium", where="at 12 kPa", what_to_do="thicker wall", status=4)
    sys.exit(4)


def crash():
    progress(0.5)
    sys.stderr.write("out of luck\n")
    sys.stderr.flush()
    os.kill(os.getpid(), signal.SIGSEGV)


def garbage():
    sys.stdout.buffer.write(b'Blender 5.2.2 LTS\n\xff\xfe{\n[1, 2]\n{"type": "unheard of"}\n\n"text"\nnull\n')
    sys.stdout.flush()
    good()


def wordless():
    progress(0.5)


def half_a_line():
    sys.stdout.write('{"type": "progress", "stage": "Model A", "fra')
    sys.stdout.flush()
    time.sleep(0.6)
    sys.stdout.write('ction": 0.5}\n')
    sys.stdout.flush()
    emit(type="result", summary={})


def lies():
    emit(type="result", summary={})
    sys.exit(3)


def flood():
    for _ in range(20_000):
        sys.stderr.write("x" * 99 + "\n")
        progress(0.5)
    emit(type="result", summary={})


def hang():
    progress(0.5)
    time.sleep(600)


def deaf():
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    hang()


def hungry():
    progress(0.5)
    kept = []
    while True:
        kept.append(bytearray(20_000_000))
        time.sleep(0.02)


def orphan():
    """Hangs, but for its parent's end; its number is told so that it can be looked for."""
    from mu_addon.run.processes import end_with_input

    end_with_input()
    emit(type="progress", stage=str(os.getpid()), state="run", fraction=0.5, seconds=1.0, seconds_left=3.0)
    time.sleep(600)


def greedy():
    """Asks for more than it is allowed at once."""
    from mu_addon.run.processes import limit_memory

    limit_memory(int(os.environ["MU_MEMORY_MB"]))
    try:
        kept = bytearray(2_000_000_000)
    except MemoryError:
        emit(type="error", what="refused", where="", what_to_do="", status=1)
        sys.exit(1)
    emit(type="result", summary={"kept": len(kept)})


if __name__ == "__main__":
    globals()[sys.argv[1]]()
