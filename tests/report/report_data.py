"""A made-up run that looks like a real one: the paper's J_hat, plausible fields, small pictures."""

import numpy as np

from mu_addon.report.results import Gate, Parameter, Path, Picture, RankingResult, ReportData, SideView

WINDOWS = [(start, length) for length in range(3, 7) for start in range(1, 8 - length)]
PATHS = tuple(Path(f"alpha{i}", start, length) for i, (start, length) in enumerate(WINDOWS, 1))
J_HAT = np.array([0.248, 0.376, 0.315, 0.155, 0.436, 0.493, 0.351, 0.550, 0.522, 0.575])
K, J = 41, 60


def protocol(k=K):
    time = np.linspace(0.0, 4.0, k)
    return time, np.interp(time, [0, 1, 2, 3, 4], [0, -20, 0, 40, 0])


def angle(pressure):
    return np.where(pressure < 0, 2.1 * pressure, 1.9 * pressure - 0.012 * pressure**2)


def deviation(j_hat, seed):
    """Delta (paths, k, j): grows with pressure and past the stiffened window, with J_hat as its mean."""
    noise = np.random.default_rng(seed)
    _, pressure = protocol()
    station = np.linspace(0.0, 1.0, J)
    delta = []
    for path, mean in zip(PATHS, j_hat, strict=True):
        center = (path.start + 0.5 * path.length - 1) / 6.0
        along = 0.05 + 1.0 / (1.0 + np.exp(-(station - center) * 9.0)) * (0.4 + 0.6 * station)
        over = np.abs(angle(pressure)) ** 1.2 * np.where(pressure < 0, 0.7, 1.0)
        field = over[:, None] * along[None] * (1.0 + 0.03 * noise.standard_normal((1, J)).cumsum(1) / 8)
        delta.append(mean * field / field.mean())
    return np.array(delta)


def ranking(j_hat, seed, **more):
    delta = deviation(j_hat, seed)
    mean = delta.mean(axis=(1, 2))
    rank = np.argsort(np.argsort(mean)) + 1
    return RankingResult(
        delta=delta,
        j_hat=mean,
        j_cont=np.sqrt((delta**2).mean(axis=(1, 2))),
        rank=rank.tolist(),
        chosen=PATHS[int(np.argmin(mean))].name,
        **more,
    )


def png(width=40, height=50):
    from mu_addon.report.render import png as encoded

    image = np.zeros((height, width, 4), np.uint8)
    image[..., 0] = np.linspace(60, 220, width)[None]
    image[..., 3] = 255
    return encoded(image)


def results(**changes):
    """A complete run; `changes` replaces fields."""
    time, pressure = protocol()
    anchors = np.stack([np.full(6, 12.5), (np.arange(6) + 0.5) * 12.5], axis=1)
    image = np.full((170, 110, 4), (150, 160, 175, 255), np.uint8)
    fields = {
        "title": "Sensor path for mu-1.0x",
        "unit": "Monolithic unit, scale 1.00, cell 12.5 mm, 6 chambers",
        "warnings": ("The pressure cycle was sampled at 41 times; 60 stations along the anchors.",),
        "view": SideView(image, (-19.0, 32.0, -6.0, 75.0), anchors),
        "pictures": (
            Picture(png(), "The unit, cut open.", "Rendering of the unit"),
            Picture(png(), "At −20 kPa: −42°.", "The unit bent away from the sensor side"),
            Picture(png(), "At 0 kPa.", "The unit at rest"),
            Picture(png(), "At 40 kPa: 57°.", "The unit bent towards the sensor side"),
        ),
        "paths": PATHS,
        "ranking": ranking(0.31 * J_HAT, 1, tied=("alpha1",), uncertainty_mm=0.03),
        "pressure_kPa": pressure,
        "angle_deg": angle(pressure),
        "protocol_s": time,
        "protocol_kPa": pressure,
        "parameters": (
            Parameter("chambers.cell_mm", 12.5, "mm", "paper, section II"),
            Parameter("chambers.count", 6, "", "paper, section II"),
            Parameter(
                "chambers.wall_mm",
                0.8,
                "mm",
                "the thinnest wall that this printer holds pressure with; the angle depends on it strongly",
                assumed=True,
            ),
            Parameter("material.lattice_modulus_kPa", 18.34, "kPa", "paper, compression of cubic specimens"),
            Parameter(
                "material.membrane_modulus_kPa", 3000.0, "kPa", "bulk elastomer at 50 Shore A", assumed=True
            ),
        ),
        "mesh": {
            "elements": 38120,
            "nodes": 61244,
            "order": 2,
            "smallest dihedral angle [deg]": 11.2,
            "volume error, membrane [%]": 0.34,
        },
        "solver": {"load steps": 46, "Newton iterations": 171, "worst residual": 3.2e-9},
        "gates": (
            Gate("genus of the bare lattice", 913, "E − V + 1 = 913", True),
            Gate("components", 1, "1", True),
            Gate("volume of the inner shell against the cavity [%]", 0.21, "at most 1", True),
        ),
        "seconds": {
            "solid": 1.5,
            "mesh": 6.2,
            "model A": 31.0,
            "paths": 64.3,
            "pictures": 9.1,
            "report": 4.0,
        },
        "versions": {"mu_addon": "0.1.0", "Python": "3.11.9", "numpy": "1.26.4", "warp": "1.19.0"},
        "files": {"deviation.csv": "a row a path and rule", "unit.stl": "the printable solid, mm"},
    }
    return ReportData(**{**fields, **changes})
