"""Seconds and memory of the print check and of the files, for one unit and for arrays of units in one piece.

    python benchmarks/print.py [--arrays 1x1 2x2 3x3] [--preset mu-1.0x] [--quality interactive]

Units of an array share their lattice's outer faces, so that the whole is one body with a chamber for each.
It is checked with all stages, written as STL and 3MF, read back and compared. Each array runs alone in a
child process, whose peak memory is told. Fails if memory per triangle grows.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import time

import numpy as np
from circumstances import circumstances

from mu_addon.design.parameters import load_preset
from mu_addon.design.printing.check import check
from mu_addon.design.printing.printer import load_printer
from mu_addon.design.solid import build_solid, printable
from mu_addon.design.surface import bad_edges, stl_bytes, stl_surface, volume
from mu_addon.design.threemf import Part, read_3mf, write_3mf

LAP = 0.02
"""Overlap of neighbouring units in mm, so that they are one body and not two that touch."""
HEAD = ("array", "triangles", "grid's box cm3", "build s", "check s", "of them processor", "files s")
HEAD += ("check", "drained chambers", "peak MB", "bytes a triangle")


def peak_mb():
    # Kilobytes on Linux, bytes on macOS.
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)


def array(unit, columns, rows, quality):
    """Surface of an array of units, one body."""
    from manifold3d import Manifold, Mesh64, OpType

    one = build_solid(unit, quality=quality)
    if columns * rows == 1:
        return one.vertices, one.triangles
    body = Manifold(Mesh64(one.vertices, one.triangles.astype(np.uint64)))
    (x0, x1), (y0, y1), _ = unit.dimensions.bounds
    pitch = np.array([x1 - x0, y1 - y0]) - LAP
    placed = [body.translate([i * pitch[0], j * pitch[1], 0.0]) for i in range(columns) for j in range(rows)]
    return printable(Manifold.batch_boolean(placed, OpType.Add))


def files(vertices, triangles):
    """Write STL and 3MF, read both back; raises AssertionError where they are not the same body."""
    enclosed = volume(vertices, triangles)
    objects, printed = read_3mf(write_3mf([Part("array", vertices, triangles)], [1], "array"))
    back = objects[printed[0]]
    for points, faces in (stl_surface(stl_bytes(vertices, triangles)), (back.vertices, back.triangles)):
        assert bad_edges(faces) == 0
        assert len(faces) == len(triangles)
        assert abs(volume(points, faces) / enclosed - 1.0) < 1e-4


def child(preset, size, quality):
    """Everything measured on one array, as JSON on the last line."""
    columns, rows = map(int, size.split("x"))
    start = time.perf_counter()
    vertices, triangles = array(load_preset(preset), columns, rows, quality)
    built, processor = time.perf_counter(), time.process_time()
    found = check(vertices, triangles, load_printer())
    checked, processor = time.perf_counter(), time.process_time() - processor
    files(vertices, triangles)
    written = time.perf_counter()
    by_name = {finding.check: finding for finding in found.findings}
    print(
        json.dumps(
            {
                "triangles": len(triangles),
                "box_cm3": float(np.prod(np.ptp(vertices, axis=0))) / 1e3,
                "seconds": [built - start, checked - built, processor, written - checked],
                "verdict": found.worst,
                "errors": [f"{f.check}: {f.what}" for f in found.findings if f.severity == "error"],
                "chamber_ml": found.figures.get("chamber_ml", 0.0),
                "drain": by_name["drain"].what if "drain" in by_name else "not examined",
                "peak_mb": peak_mb(),
            }
        )
    )


def main():
    if sys.argv[1:2] == ["--child"]:
        child(*sys.argv[2:5])
        return
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--arrays", nargs="+", default=["1x1", "2x2", "3x3"], metavar="NxM")
    options.add_argument("--preset", default="mu-1.0x")
    options.add_argument("--quality", choices=("interactive", "export"), default="interactive")
    given = options.parse_args()
    print(circumstances())
    print("\n| " + " | ".join(HEAD) + " |\n" + "| --- " * len(HEAD) + "|", flush=True)
    found = []
    for size in given.arrays:
        command = [sys.executable, __file__, "--child", given.preset, size, given.quality]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            sys.exit(f"{size}:\n{done.stderr[-3000:]}")
        one = json.loads(done.stdout.splitlines()[-1])
        found.append(one)
        cells = [size, one["triangles"], f"{one['box_cm3']:.0f}", *(f"{s:.1f}" for s in one["seconds"])]
        cells += [one["verdict"], f"{one['chamber_ml']:.1f} ml", f"{one['peak_mb']:.0f}"]
        cells.append(f"{one['peak_mb'] * 2**20 / one['triangles']:.0f}")
        print("| " + " | ".join(map(str, cells)) + " |", flush=True)
        for error in one["errors"]:
            print(f"{size}: {error}", file=sys.stderr)
    shares = [one["peak_mb"] / one["triangles"] for one in found]
    if max(shares) > 1.001 * shares[0]:
        sys.exit("memory grew faster than triangles")


if __name__ == "__main__":
    main()
