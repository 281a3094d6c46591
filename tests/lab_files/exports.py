"""Files laid out as makers of test machines document their exports, with readings that are known.

A coupon of 12.5 x 3 mm and 40 mm between the grips, pulled at 0.5 mm/s, of 2.5 MPa: force in N is 2.34375
times the displacement in mm. All were written for these tests.
"""

from __future__ import annotations

ROWS = 24
TIME = [0.05 * i for i in range(ROWS)]
MM = [0.5 * t for t in TIME]
N = [2500.0 * x / 40.0 * 12.5 * 3.0 / 1000.0 for x in MM]


def _rows(columns, separator, comma=False, quoted=False):
    lines = []
    for values in zip(*columns, strict=True):
        cells = [f"{v:.8f}" for v in values]
        cells = [c.replace(".", ",") for c in cells] if comma else cells
        lines.append(separator.join(f'"{c}"' for c in cells) if quoted else separator.join(cells))
    return "\n".join(lines) + "\n"


BLUEHILL = (
    '"Specimen label","A1"\n"Test type","Tensile"\n"Width","12.5","mm"\n"Thickness","3.0","mm"\n'
    '"Gauge length","40.0","mm"\n\n"Time","Extension","Load"\n"(s)","(mm)","(N)"\n'
    + _rows([TIME, MM, N], ",", quoted=True)
)
TESTXPERT = (
    "Pr\u00fcfbericht;Zugversuch\nProbenbezeichnung;A1\nProbendicke a0;3,0;mm\nProbenbreite b0;12,5;mm\n"
    "Messl\u00e4nge L0;40,0;mm\n\nPr\u00fcfzeit;Standardweg;Standardkraft\ns;mm;N\n"
    + _rows([TIME, MM, N], ";", comma=True)
)
TRAPEZIUM = (
    '"1 _ 1",,,"1 _ 2",,\n"Time","Force","Stroke","Time","Force","Stroke"\n"sec","N","mm","sec","N","mm"\n'
    + _rows([TIME, N, MM, TIME, [2 * f for f in N], MM], ",", comma=True, quoted=True)
)
# MTS's text files name titles and units anew wherever acquisition goes on.
_HEAD = "Data Header:\tTime:\t{}\tSec\nData Acquisition: Timed\nStation Name: one.cfg\n"
_TITLES = "Time\tAxial Displacement\tAxial Force\nSec\tmm\tkN\n"
MTS = "".join(
    _HEAD.format(TIME[part.start])
    + _TITLES
    + _rows([TIME[part], MM[part], [f / 1000 for f in N[part]]], "\t")
    + "\n"
    for part in (slice(0, 10), slice(10, ROWS))
)
HORIZON = "".join(
    f"Specimen {k}\nForce (N),Position (mm),Time (s)\n" + _rows([N, [3.7 + x for x in MM], TIME], ",") + "\n"
    for k in (1, 2)
)
PLAIN = "Nr\tWeg\tKraft\n" + _rows([range(ROWS), MM, N], "\t")
IMPERIAL = "Elapsed time [min]\tCrosshead [in]\tLoad [lbf]\tStress / N/mm\u00b2\n" + "".join(
    f"{t / 60:.8f}\t{x / 25.4:.8f}\t{f / 4.4482216152605:.8f}\t{f / 37.5:.8f}\n"
    for t, x, f in zip(TIME, MM, N, strict=True)
)
LADDER = "time_s,pressure_kPa,angle_deg\n" + "".join(f"{t:.2f},{10 * t:.3f},{3 * t:.4f}\n" for t in TIME)
HOLD = "Zeit;Druck\nms;mbar\n" + "".join(f"{int(1000 * t)};{400 - i}\n" for i, t in enumerate(TIME))
