"""Pictures and charts of a homogenised lattice: cell, directional stiffness, virtual tests."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any

import attrs
import numpy as np

from ..homogenize.compression import Compression
from ..homogenize.elasticity import young_modulus
from ..homogenize.foam_fit import FoamFit
from ..homogenize.stress_strain_curve import Curve
from ..homogenize.stretch import Stretched
from .heatmaps import MAP
from .plots import BY_LENGTH, CHOSEN, INK, QUIET, WIDTH, canvas
from .render import Camera, Floats, Image, Part, fit, png, render
from .results import Picture
from .shapes import box, tube
from .unit_pictures import WHITE, skin

STRUT_COLOR = (0.62, 0.69, 0.77)
PLATE_COLOR = (0.30, 0.33, 0.38)
TOWARDS = (1.0, -0.62, 0.42)


def unfolded(nodes: Floats, faces: Any, planes: Floats) -> tuple[Floats, Any]:
    """The whole body's skin of one eighth's: nodes (n, 3), faces (f, 3), mirrored in planes (3,) in mm."""
    vertices: list[Floats] = []
    triangles: list[Any] = []
    for flips in product((False, True), repeat=3):
        image = np.where(flips, 2.0 * planes - nodes, nodes)
        triangles.append((faces[:, ::-1] if sum(flips) % 2 else faces) + len(nodes) * len(vertices))
        vertices.append(image)
    return np.vstack(vertices), np.vstack(triangles)


def cell_picture(nodes: Floats, faces: Any, size: float, density: float, width: int = 620) -> Picture:
    """Picture of one printed cell of the lattice, from its octant's skin (without the cut faces' names)."""
    vertices, triangles = unfolded(nodes, faces, np.full(3, size / 2))
    parts = [Part(vertices, triangles, STRUT_COLOR), *_frame(size)]
    camera = fit(parts, TOWARDS, margin=0.03)
    image = render(parts, camera, width, width, background=WHITE)
    return Picture(
        png(image),
        f"One cell of {size:g} mm as it is printed; {density:.1%} of its bounding box is solid.",
        "A cell of the lattice: struts from its centre to its corners, inside a wire box.",
    )


def _frame(size: float) -> list[Part]:
    """The edges of a cell's box as thin rods."""
    radius = 0.006 * size
    found = []
    for axis in range(3):
        for a, b in product((0.0, size), repeat=2):
            ends = np.insert(np.array([[a, b], [a, b]]), axis, [0.0, size], axis=1)
            found.append(Part(*tube(ends, radius, 8), PLATE_COLOR, whole=True))
    return found


def modulus_surface(C: Floats, width: int = 620) -> Picture:
    """Young's modulus in every direction as a surface: its distance from the middle is the modulus.

    C: (6, 6) in MPa in Voigt's order.
    """
    directions, faces = _sphere(140, 70)
    modulus = 1e3 * young_modulus(C, directions)
    axes = np.array([[1, 0, 0], [1, 1, 0], [1, 1, 1]]) / np.sqrt([[1], [2], [3]])
    along = 1e3 * young_modulus(C, axes)
    low, high = float(modulus.min()), float(modulus.max())
    from matplotlib import colormaps

    share = (modulus - low) / (high - low) if high > low * (1 + 1e-9) else np.full(len(modulus), 0.5)
    color = colormaps[MAP](share)[:, :3]
    part = Part(directions * modulus[:, None], faces, color)
    reach = 1.15 * high

    rods = [
        Part(*tube(np.array([-reach * e, reach * e]), 0.008 * reach, 8), PLATE_COLOR, whole=True)
        for e in np.eye(3)
    ]
    camera = fit([part, *rods], TOWARDS, margin=0.08)
    image = render([part, *rods], camera, width, width, background=WHITE)
    image = _labelled(
        image, camera, [(reach * e * 1.07, name) for e, name in zip(np.eye(3), "xyz", strict=True)]
    )
    return Picture(
        _with_scale(image, low, high),
        f"Young's modulus of the lattice by direction: {along[0]:.3g} kPa along an axis of the cell [100], "
        f"{along[1]:.3g} kPa along a face diagonal [110], {along[2]:.3g} kPa along a strut [111].",
        "Surface around the origin whose radius is Young's modulus; largest along the struts.",
    )


def _sphere(around: int, up: int) -> tuple[Floats, Any]:
    """Directions (n, 3) and triangles of a sphere divided along meridians and parallels."""
    phi = 2 * np.pi * np.arange(around) / around
    theta = np.pi * (np.arange(up) + 0.5) / up
    t, p = np.meshgrid(theta, phi, indexing="ij")
    ring = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(up - 1), np.arange(around), indexing="ij")
    a, b = i * around + j, i * around + (j + 1) % around
    faces = np.stack([a, a + around, b + around, a, b + around, b], axis=-1).reshape(-1, 3)
    top, bottom = up * around, up * around + 1
    k = np.arange(around)
    after = (k + 1) % around
    last = (up - 1) * around
    caps = [np.stack([np.full(around, top), k, after], 1)]
    caps += [np.stack([np.full(around, bottom), last + after, last + k], 1)]
    return np.vstack([ring, [[0, 0, 1], [0, 0, -1]]]), np.vstack([faces, *caps])


def _labelled(image: Image, camera: Camera, words: Sequence[tuple[Floats, str]]) -> Image:
    """A picture with labels at points in space."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    height, width = image.shape[:2]
    left, right, bottom, top = camera.extent(width / height)
    figure = Figure(figsize=(width / 100, height / 100), dpi=100)
    drawn = FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.imshow(image, extent=(left, right, bottom, top), aspect="auto")
    axes.axis("off")
    for point, text in words:
        x, y = camera.axes[:2] @ point
        axes.text(x, y, text, ha="center", va="center", fontsize=13, color=INK, fontweight="bold")
    drawn.draw()
    return np.asarray(drawn.buffer_rgba())[..., :3].copy()


def _with_scale(image: Image, low: float, high: float) -> bytes:
    """A picture with a colour bar from low to high kPa below it, as PNG."""
    import io

    from matplotlib import rc_context
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure

    height, width = image.shape[:2]
    extra = 70
    with rc_context({"font.family": "DejaVu Sans"}):
        figure = Figure(figsize=(width / 100, (height + extra) / 100), dpi=100, facecolor="white")
        FigureCanvasAgg(figure)
        share = extra / (height + extra)
        axes = figure.add_axes((0, share, 1, 1 - share))
        axes.imshow(image, aspect="auto")
        axes.axis("off")
        bar = figure.add_axes((0.12, 0.68 * share, 0.76, 0.22 * share))
        made = figure.colorbar(
            ScalarMappable(Normalize(low, max(high, low * 1.001)), MAP), cax=bar, orientation="horizontal"
        )
        made.set_label("Young's modulus [kPa]", fontsize=10)
        bar.tick_params(labelsize=9)
        stream = io.BytesIO()
        figure.savefig(stream, format="png")
    return stream.getvalue()


def test_pictures(test: Compression) -> list[tuple[str, Picture]]:
    """File name and picture of a test between its plates, at rest, half way and at its end, to one scale."""
    nodes, last = test.specimen.mesh.nodes, test.states[-1]
    faces = skin(test.specimen.mesh.tets)
    middle = min(test.states, key=lambda s: abs(s.strain - last.strain / 2))
    shown, scenes = (test.states[0], middle, last), []
    for state in shown:
        vertices, triangles = unfolded(np.asarray(nodes + state.u), faces, np.zeros(3))
        # The plates are where the outermost nodes of the loaded faces are.
        low, high = vertices[:, 2].min(), vertices[:, 2].max()
        half = 1.12 * np.ptp(nodes[:, 0])
        thick = 0.04 * half
        plates = [
            Part(*box([-half, -half, z], [half, half, z + thick]), PLATE_COLOR) for z in (low - thick, high)
        ]
        scenes.append([Part(vertices, triangles, STRUT_COLOR), *plates])
    camera = fit([part for scene in scenes for part in scene], (1.0, -0.55, 0.22), margin=0.02)
    return [
        (
            f"specimen_{100 * strain:.0f}.png",
            Picture(
                png(render(scene, camera, 460, 460, background=WHITE)),
                "undeformed" if strain == 0 else f"at {strain:.0%} of nominal strain",
                f"The specimen between two plates at {strain:.0%} strain.",
            ),
        )
        for scene, strain in zip(scenes, (state.strain for state in shown), strict=True)
    ]


@attrs.frozen(eq=False)
class Line:
    """One curve of a chart: strain (compression positive) and stress in kPa; solid up to `valid_to`."""

    name: str
    strain: Floats
    stress_kPa: Floats
    valid_to: float = np.inf


def lines_of(tests: Mapping[str, Compression], cell: Stretched | None) -> list[Line]:
    """Compressed side of each test, by its name, and of the periodic cell."""
    found = []
    for name, curve, valid in [
        *((name, test.curve, test.valid_to_strain) for name, test in tests.items()),
        *([("periodic lattice", cell.curve, np.inf)] if cell else []),
    ]:
        side = curve.stretch <= 1
        found.append(Line(name, -curve.strain[side][::-1], -1e3 * curve.stress_MPa[side][::-1], valid))
    return found


def compression_chart(lines: Sequence[Line]) -> str:
    """Nominal stress against strain; dashed where struts have met."""
    with canvas(WIDTH, 3.3) as (figure, svg):
        axes = figure.add_axes((0.14, 0.15, 0.82, 0.81))
        colors = (CHOSEN, BY_LENGTH[0], BY_LENGTH[1], QUIET)
        for line, color in zip(lines, colors, strict=False):
            sound = line.strain <= line.valid_to + 1e-12
            axes.plot(
                line.strain[sound] * 100,
                line.stress_kPa[sound],
                "-",
                color=color,
                linewidth=1.8,
                label=line.name,
            )
            if not sound.all():
                rest = max(int(sound.sum()) - 1, 0)
                axes.plot(line.strain[rest:] * 100, line.stress_kPa[rest:], ":", color=color, linewidth=1.8)
                axes.plot(line.strain[rest] * 100, line.stress_kPa[rest], "o", color=color, markersize=4)
        axes.set(xlabel="compression [%]", ylabel="nominal stress [kPa]", xlim=(0, None), ylim=(0, None))
        axes.legend(loc="upper left")
    return svg()


def stretch_chart(cell: Curve, fit: FoamFit, lateral: bool) -> str:
    """Stress, or lateral stretch, of the periodic cell (dots) and of the fitted law (line) against strain."""
    along = np.linspace(*fit.stretch, 121)
    fitted = fit.uniaxial(along)[1] if lateral else 1e3 * fit.uniaxial(along)[0]
    values = cell.lateral.mean(axis=1) if lateral else cell.stress_MPa * 1e3
    with canvas(WIDTH, 2.9) as (figure, svg):
        axes = figure.add_axes((0.16, 0.17, 0.80, 0.79))
        axes.axvline(0, color=QUIET, linewidth=0.8)
        axes.plot((along - 1) * 100, fitted, "-", color=CHOSEN, linewidth=1.8, label="fitted law")
        axes.plot(cell.strain * 100, values, "o", color=BY_LENGTH[0], markersize=3.5, label="cell")
        axes.set(xlabel="strain [%]", ylabel="lateral stretch" if lateral else "nominal stress [kPa]")
        axes.legend(loc="lower center" if lateral else "upper left")
    return svg()
