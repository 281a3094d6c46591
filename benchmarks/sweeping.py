"""What a sweep costs besides its studies: seconds and bytes a point, on one, two and 64 workers.

python benchmarks/sweeping.py            # stand-ins for studies, so that only the rest is measured
python benchmarks/sweeping.py --real 16  # also so many real studies, on one and two workers
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import resource
import socket
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "benchmarks")]

from circumstances import circumstances  # noqa: E402

from mu_addon.run.context import run_to_end  # noqa: E402
from mu_addon.run.progress import Progress  # noqa: E402
from mu_addon.usecases.parameter_study.cluster import Cluster  # noqa: E402
from mu_addon.usecases.parameter_study.plan import parse_plan  # noqa: E402
from mu_addon.usecases.parameter_study.point import Task, run_point, version  # noqa: E402
from mu_addon.usecases.parameter_study.run import USE_CASE, Job  # noqa: E402

POINTS = 200
# What a real study of this sweep answers, so that as many bytes travel back.
SUMMARY = ROOT / "tests" / "data" / "studies" / "format-1" / "summary.json"
PRINT_ANSWER = "import sys; print(open(sys.argv[1] + '/answer.json').read())"
TEXT = """
format = 1
preset = "mu-1.0x"
stages = "simulate"
method = "sobol"
points = {points}
memory_MB = 2000
[simulate]
times = 3
mesh = {{ refine = 0.3 }}
self_contact = false
[vary]
"chambers.wall_mm" = {{ low = 0.8, high = 1.2 }}
"material.membrane_modulus_kPa" = {{ low = 1500.0, high = 4000.0 }}
"""


def tasks(seconds=0.0):
    """Tasks as a sweep makes them; each carries what its stand-in is to do."""
    plan = parse_plan(TEXT.format(points=POINTS), ROOT)
    points = plan.points(plan.values()[0])
    summary = json.loads(SUMMARY.read_text())
    answer = json.dumps({"type": "result", "summary": summary})
    extra = {"answer.json": answer, "seconds.txt": str(seconds)}
    return [Task(p.job.texts() | extra, 2000, 1.0, version(), ("-c", PRINT_ANSWER)) for p in points]


def at_once(task):
    """A study that takes no more than what it is told to, in the worker itself."""
    time.sleep(float(task.files["seconds.txt"]))
    return {
        "status": "done",
        "seconds": 0.0,
        "memory_MB": 0,
        "summary": json.loads(task.files["answer.json"]),
    }


def timed(cluster, some, work):
    begun, worked = time.perf_counter(), processor_s()
    found = [row for _, row in cluster.results(some, work, print)]
    taken, worked = time.perf_counter() - begun, processor_s() - worked
    assert len(found) == len(some), "a point was lost"
    assert all(row["status"] == "done" for row in found), next(r for r in found if r["status"] != "done")
    return taken, worked


def processor_s():
    """Processor time of this process and of the children that have ended: other work does not lengthen it."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def overhead():
    print("| 200 points | workers | seconds | processor time a point [ms] |\n| --- | --- | --- | --- |")
    for what, work, each in (
        ("nothing to do: Dask alone", at_once, (1, 2, 64)),
        ("a process each, which does nothing", run_point, (1, 2)),
    ):
        for workers in each:
            cluster = Cluster(None, workers)
            taken, worked = timed(cluster, tasks(), work)
            cluster.close()
            print(f"| {what} | {workers} | {taken:.1f} | {1e3 * worked / POINTS:.1f} |", flush=True)
    for seconds in (1.0, 5.0):
        cluster = Cluster(None, 64)
        taken, worked = timed(cluster, tasks(seconds), at_once)
        cluster.close()
        ideal = -(-POINTS // 64) * seconds
        what = f"{seconds:g} s of sleep each: {ideal / taken:.0%} of the ideal {ideal:g} s"
        print(f"| {what} | 64, simulated | {taken:.1f} | {1e3 * worked / POINTS:.1f} |", flush=True)


class Counter:
    """A relay on the loopback between a scheduler and all who talk to it, which counts bytes."""

    def __init__(self, target):
        self.target, self.up, self.down, self.port = target, 0, 0, free_port()
        self.loop = asyncio.new_event_loop()
        ready = threading.Event()

        async def serve():
            await asyncio.start_server(self.relay, "127.0.0.1", self.port)
            ready.set()
            await asyncio.Event().wait()

        threading.Thread(target=lambda: self.loop.run_until_complete(serve()), daemon=True).start()
        ready.wait()

    async def relay(self, reader, writer):
        onward = await asyncio.open_connection("127.0.0.1", self.target)

        async def copy(source, sink, name):
            while data := await source.read(65536):
                setattr(self, name, getattr(self, name) + len(data))
                sink.write(data)
                await sink.drain()
            sink.close()

        await asyncio.gather(
            copy(reader, onward[1], "up"), copy(onward[0], writer, "down"), return_exceptions=True
        )


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def wait_for(port):
    """Until something listens there."""
    for _ in range(600):
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.2)
    raise TimeoutError(port)


def traffic():
    """Bytes that pass a scheduler a point, to and from one worker and the sweep, over real connections."""
    port = free_port()
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), str(ROOT / "benchmarks")])}

    def start(*words):
        return subprocess.Popen(
            [sys.executable, "-m", *words, "--host", "127.0.0.1", "--no-dashboard"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment,
        )  # fmt: skip

    processes = [start("distributed.cli.dask_scheduler", "--port", str(port))]
    counter = Counter(port)
    address = f"tcp://127.0.0.1:{counter.port}"
    try:
        wait_for(port)
        processes.append(start("distributed.cli.dask_worker", address, "--nthreads", "1", "--no-nanny"))
        cluster = Cluster(address, 1)
        while not cluster.threads:
            time.sleep(0.2)
        # Once before, so that what is sent a single time is not counted.
        timed(cluster, tasks()[:5], run_point)
        before = counter.up, counter.down
        time.sleep(10)
        idle = counter.up - before[0] + counter.down - before[1]
        before = counter.up, counter.down
        begun = time.perf_counter()
        timed(cluster, tasks(), run_point)
        taken = time.perf_counter() - begun
        up, down = counter.up - before[0], counter.down - before[1]
        cluster.close()
    finally:
        for process in processes:
            process.kill()
    task, row = tasks()[0], at_once(tasks()[0])
    print("\n| bytes a point | |\n| --- | --- |")
    asked, answered = len(json.dumps(dict(task.files))), len(json.dumps(row))
    print(f"| inputs of a study, and its answer | {asked} and {answered} |")
    print(f"| into the scheduler | {up / POINTS:.0f} |\n| out of the scheduler | {down / POINTS:.0f} |")
    print(f"| of these, what an idle cluster says in the meantime | {idle / 10 * taken / POINTS:.0f} |")


def real(count):
    print(f"\n| {count} real studies | seconds | a study [s] | studies an hour |\n| --- | --- | --- | --- |")
    for workers in (1, 2):
        with tempfile.TemporaryDirectory() as name, run_to_end(Progress()) as context:
            begun = time.perf_counter()
            job = Job(parse_plan(TEXT.format(points=count), ROOT), workers=workers)
            found = USE_CASE.start(job, Path(name), context)
            taken = time.perf_counter() - begun
        assert context.status == 0
        assert not found.failed
        mean = sum(row["seconds"] for row in found.done) / count
        print(f"| {workers} workers | {taken:.0f} | {mean:.1f} | {3600 * count / taken:.0f} |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--real", type=int, default=0, metavar="N", help="real studies, too")
    given = parser.parse_args()
    print(circumstances() + "\n")
    overhead()
    traffic()
    if given.real:
        real(given.real)


if __name__ == "__main__":
    main()
