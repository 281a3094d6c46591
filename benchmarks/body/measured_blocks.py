"""Measured compression of 3 x 3 x 3 body-centred blocks against swept struts of the same resin's coupons.

    python -m benchmarks.body.measured_blocks DATA [--rings 2] [--layers 10] [--poisson 0.4]

DATA: folder `data/inelastic_beam_lattices` of CPShub/sim-data (CC BY 4.0), of O. Weeger, I. Valizadeh, Y.
Mistry, D. Bhate, "Inelastic finite deformation beam modeling, simulation, and validation of additively
manufactured lattice structures". Cells of 10 mm, round struts of 1.2 mm, an acrylic resin printed by
projection. Nothing is fitted to a block: the law comes from the coupons pulled at the same rate.
"""

from __future__ import annotations

import time
from pathlib import Path

import attrs
import numpy as np
from scipy.optimize import least_squares

from benchmarks.table import options_of
from mu_addon.body.strut import strut_mesh
from mu_addon.design import lattice_kinds
from mu_addon.design.parameters import load_preset
from mu_addon.fem.materials import Layer, Materials
from mu_addon.homogenize.compression import compress
from mu_addon.homogenize.specimen import block_specimen

from .knowles import Knowles, pulled_MPa

CELL_MM, STRUT_MM, CELLS = 10.0, 1.2, 3
# Nominal rates of strain agree: 3.75 mm/min on 30 mm of block and 5 mm/min on 40 mm of coupon.
RATES = {
    "0.0021 /s": (
        ("msla_bcc_test_r375_L1.txt", "msla_bcc_test_r375_L2.txt"),
        "msla_He3_test_cycle_r5_s{}.txt",
    ),
    "0.00021 /s": (("msla_bcc_test_r0375_L3.txt",), "msla_He3_test_cycle_r05_s{}.txt"),
}
SEATING_mm = 0.04  # as the authors subtract
PLACES_mm = (1.0, 2.0, 3.0, 4.4)
# Where both initial slopes are read, in mm of the block and in strain of a coupon.
SLOPE_mm, SLOPE_STRAIN = (0.1, 0.3), (0.0005, 0.0025)


def loading(path, x, y):
    """The columns x and y of a test up to its largest x."""
    table = np.genfromtxt(path, names=True)
    end = int(table[x].argmax()) + 1
    return table[x][:end], table[y][:end]


def slope(x, y, between):
    inside = (x >= between[0]) & (x <= between[1])
    return float(np.polyfit(x[inside], y[inside], 1)[0])


def coupons(folder, pattern):
    """Initial Young's modulus in MPa, mean of three coupons, and their loading branches as one curve."""
    branches = [loading(folder / pattern.format(k), "Strain", "Stress") for k in (3, 6, 9)]
    initial = [slope(*branch, SLOPE_STRAIN) for branch in branches]
    return initial, branches


def fitted(branches, poisson):
    """Knowles's parameters of coupons that were pulled, every one with the same say at every strain."""
    grids = [(np.linspace(0.001, e.max(), int(e.max() / 0.001)), e, s) for e, s in branches]
    strain = np.concatenate([grid for grid, _, _ in grids])
    stress = np.concatenate([np.interp(grid, e, s) for grid, e, s in grids])

    def of(q):
        mu, b = np.exp(q[:2])
        n = 0.5 + q[2] ** 2
        return mu, b, n, 2 * mu * (1 + poisson) / (3 * (1 - 2 * poisson))

    def off(q):
        return (pulled_MPa(1 + strain, *of(q)) - stress) / stress.max()

    found = least_squares(off, [np.log(200.0), np.log(1e-3), 0.1])
    return of(found.x), float(np.sqrt(np.mean(found.fun**2)))


def main() -> None:
    parser = options_of(__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("--rings", type=int, default=2)
    parser.add_argument("--layers", type=int, default=10)
    parser.add_argument(
        "--poisson", type=float, default=0.4, help="Not measured; 0.4 is usual of glassy acrylics."
    )
    options = parser.parse_args()
    d = attrs.evolve(
        load_preset("mu-1.0x").dimensions,
        kind=lattice_kinds.kind("body-centred-straight"),
        cell=CELL_MM,
        junction_diameter=STRUT_MM,
        midspan_diameter=STRUT_MM,
    )
    octant = strut_mesh(d, options.rings, options.layers)
    count, side = len(octant.tets), CELLS * CELL_MM
    print("| rate | block or model | slope N/mm | " + " | ".join(f"{p:g} mm N" for p in PLACES_mm) + " | s |")
    print("| --- " * (4 + len(PLACES_mm)) + "|", flush=True)
    for rate, (blocks, pattern) in RATES.items():
        measured = []
        for block in blocks:
            way, force = loading(options.data / block, "Weg", "Kraft")
            way = way - SEATING_mm
            measured.append([slope(way, force, SLOPE_mm), *np.interp(PLACES_mm, way, force)])
            print(f"| {rate} | {block} | " + " | ".join(f"{v:.1f}" for v in measured[-1]) + " | |")
        mean = np.mean(measured, axis=0)
        initial, branches = coupons(options.data, pattern)
        parameters, off = fitted(branches, options.poisson)
        E = float(np.mean(initial))
        softening = Materials((Layer(Knowles, np.arange(count), np.tile(parameters, (count, 1))),))
        models = {
            f"elastic, {E:.0f} MPa": Materials.neo_hooke(np.full(count, E), np.full(count, options.poisson)),
            "softening as the coupons": softening,
        }
        told = (
            f"{', '.join(f'{v:.0f}' for v in initial)} MPa; mu {parameters[0]:.0f} MPa, b {parameters[1]:.2e}"
        )
        told += f", n {parameters[2]:.3f}, off by {100 * off:.1f} % of the largest stress"
        print(f"| {rate} | coupons: {told} |" + " |" * (2 + len(PLACES_mm)), flush=True)
        for name, materials in models.items():
            for friction, words in (("slide", "plates slide"), ("stick", "plates hold")):
                began = time.perf_counter()
                block = block_specimen(octant, CELLS, materials)
                places = [1e-3, *SLOPE_mm, *PLACES_mm]
                test = compress(block, [p / side for p in places], friction, threads=1, stability=False)
                way = np.array([state.strain * side for state in test.states])
                force = np.array([state.force_N for state in test.states])
                read = np.interp([*SLOPE_mm, *PLACES_mm], way, force, right=np.nan)
                values = np.array([(read[1] - read[0]) / (SLOPE_mm[1] - SLOPE_mm[0]), *read[2:]])
                cells = [f"{v:.1f} ({100 * (v / m - 1):+.0f} %)" for v, m in zip(values, mean, strict=True)]
                seconds = time.perf_counter() - began
                print(
                    f"| {rate} | {name}, {words} | " + " | ".join(cells) + f" | {seconds:.0f} |", flush=True
                )
                if test.ended:
                    print(test.ended)


if __name__ == "__main__":
    main()
