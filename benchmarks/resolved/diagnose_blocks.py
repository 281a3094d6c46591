"""What `diagnose` says of measured blocks of struts and of the same resin's coupons.

    python -m benchmarks.resolved.diagnose_blocks DATA FOLDER

DATA: as `measured_blocks` takes it. Writes three folders of measured data below FOLDER, the blocks, the
coupons and both together, and gives each to `diagnose`. Blocks were recorded without a clock: their times are
those of the nominal speed.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

import numpy as np

from .measured_blocks import CELL_MM, CELLS, SEATING_mm

RUN = Path(__file__).parents[2] / "headless" / "run.py"
ROWS = 240
# Nominal speeds in mm/min.
BLOCKS = {"L1": ("r375", 3.75), "L2": ("r375", 3.75), "L3": ("r0375", 0.375)}
COUPONS = [f"cycle_{rate}_s{size}" for rate in ("r5", "r05") for size in (3, 6, 9)]
COUPONS += [f"relax_{rate}" for rate in ("r5", "r05", "r01")]
COUPON_mm, COUPON_mm2 = 40.0, 12.1


def block(data: Path, name: str) -> tuple[str, str]:
    """A block's rows as CSV, and its entry in experiments.toml."""
    rate, speed = BLOCKS[name]
    table = np.genfromtxt(data / f"msla_bcc_test_{rate}_{name}.txt", names=True)
    way, force = table["Weg"] - SEATING_mm, table["Kraft"]
    clock = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(way)))]) / (speed / 60.0)
    keep = (way > 0) & (np.concatenate([[1.0], np.diff(clock)]) > 0)
    side = CELLS * CELL_MM
    entry = (
        f'kind = "lattice_compression"\ncells = {CELLS}\nplates = "hold"\naxis = "z"\nspecimen = "{name}"\n'
    )
    entry += f"section_mm = [{side}, {side}]\nlength_mm = {side}\n"
    return rows("time_s,displacement_mm,force_N", clock[keep], way[keep], force[keep]), entry


def coupon(data: Path, name: str) -> tuple[str, str]:
    """A coupon's rows as CSV, and its entry in experiments.toml."""
    table = np.genfromtxt(data / f"msla_He3_test_{name}.txt", names=True)
    keep = np.concatenate([[True], np.diff(table["Time"]) > 0])
    entry = f'kind = "coupon"\nmode = "uniaxial"\nspecimen = "{name}"\nlength_mm = {COUPON_mm}\n'
    side = COUPON_mm2**0.5
    entry += f"section_mm = [{side:.6f}, {side:.6f}]\n"
    return rows("time_s,displacement_mm,force_N", *(table[k][keep] for k in ("Time", "Weg", "Kraft"))), entry


def rows(head: str, *columns: np.ndarray) -> str:
    """Columns as CSV, at most ROWS of them, evenly spaced in number."""
    at = np.unique(np.linspace(0, len(columns[0]) - 1, ROWS).round().astype(int))
    lines = (",".join(f"{v:.7g}" for v in row) for row in zip(*(c[at] for c in columns), strict=True))
    return "\n".join([head, *lines]) + "\n"


def write(folder: Path, experiments: dict[str, tuple[str, str]]) -> None:
    """A folder of measured data, of the rows and the entry of each experiment."""
    folder.mkdir(parents=True, exist_ok=True)
    texts = []
    for name, (table, entry) in experiments.items():
        (folder / f"{name}.csv").write_text(table)
        texts.append(f'[[experiment]]\nname = "{name}"\nfile = "{name}.csv"\nrole = "fit"\n{entry}')
    (folder / "experiments.toml").write_text("\n".join(texts))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path)
    parser.add_argument("folder", type=Path)
    options = parser.parse_args()
    blocks = {name: block(options.data, name) for name in BLOCKS}
    coupons = {name: coupon(options.data, name) for name in COUPONS}
    for name, experiments in {"blocks": blocks, "coupons": coupons, "both": blocks | coupons}.items():
        folder = options.folder / name
        write(folder, experiments)
        print(name, flush=True)
        command = [sys.executable, RUN, "diagnose", folder, "--out", options.folder / f"{name}-verdict"]
        subprocess.run([*map(str, command), "--no-report"], check=False)


if __name__ == "__main__":
    main()
