"""3MF: the printable solid as a mesh, and the unit as an actuator with a lattice of beams.

A package is a ZIP of three parts: content types, the relationship to the model, and the model in XML, as the
3MF Core Specification 1.3 and the Beam Lattice Extension 1.2 have them. Lengths are millimetres.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterable, Sequence
from xml.etree import ElementTree
from xml.sax.saxutils import escape, quoteattr

import attrs
import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..errors import InputError
from .surface import Triangles, Vertices

CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
BEAMS = "http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02"
MODEL_TYPE = "application/vnd.ms-package.3dmanufacturing-3dmodel+xml"
RELATIONSHIP = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"

_MODEL = "3D/3dmodel.model"
_TYPES = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    f'<Default Extension="model" ContentType="{MODEL_TYPE}"/></Types>\n'
)
_RELATIONSHIPS = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    f'<Relationship Target="/{_MODEL}" Id="rel0" Type="{RELATIONSHIP}"/></Relationships>\n'
)
# The earliest time of a zip; a fixed one makes equal models equal files.
_LONG_AGO = (1980, 1, 1, 0, 0, 0)


@attrs.frozen(eq=False)
class Beams:
    """Beams as frusta with round ends: nodes (n, 3) in mm, pairs (b, 2) of nodes, end radii (b, 2) in mm."""

    nodes: Array
    pairs: NDArray[np.int64]
    radii: Array

    @property
    def lengths(self) -> Array:
        """Length (b,) of every beam in mm."""
        return np.asarray(np.linalg.norm(np.diff(self.nodes[self.pairs], axis=1)[:, 0], axis=1))

    @property
    def volume(self) -> float:
        """Sum of the frusta's volumes in mm3; overlaps count more than once."""
        r, q = self.radii.T
        return float(np.pi / 3.0 * np.sum(self.lengths * (r * r + r * q + q * q)))


@attrs.frozen(eq=False)
class Part:
    """One object of a model: triangles (m, 3) between vertices (n, 3) in mm, beams, or both.

    clipped_to: number of the object that its beams are cut to.
    """

    name: str
    vertices: Vertices = attrs.field(factory=lambda: np.zeros((0, 3)))
    triangles: Triangles = attrs.field(factory=lambda: np.zeros((0, 3), np.int64))
    beams: Beams | None = None
    clipped_to: int | None = None


def write_3mf(parts: Sequence[Part], printed: Sequence[int], title: str) -> bytes:
    """Content of a 3MF file (a zip) of these objects, numbered from 1, lengths in mm.

    printed: numbers of the objects to print, which become one build item. Source: 3MF Core Specification 1.3
    and Beam Lattice Extension 1.2.
    """
    extension = f' xmlns:b="{BEAMS}" requiredextensions="b"' if any(p.beams for p in parts) else ""
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<model unit="millimeter" xml:lang="en-US" xmlns="{CORE}"{extension}>',
        f' <metadata name="Title">{escape(title)}</metadata>',
        " <resources>",
    ]
    for number, part in enumerate(parts, 1):
        lines += [
            f'  <object id="{number}" type="model" name={quoteattr(part.name)}>',
            *_mesh(part),
            "  </object>",
        ]
    build = printed[0]
    if len(printed) > 1:
        build = len(parts) + 1
        lines += [f'  <object id="{build}" type="model" name={quoteattr(title)}>', "   <components>"]
        lines += [f'    <component objectid="{number}"/>' for number in printed]
        lines += ["   </components>", "  </object>"]
    lines += [" </resources>", " <build>", f'  <item objectid="{build}"/>', " </build>", "</model>", ""]
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as package:
        for name, text in (
            ("[Content_Types].xml", _TYPES),
            ("_rels/.rels", _RELATIONSHIPS),
            (_MODEL, "\n".join(lines)),
        ):
            entry = zipfile.ZipInfo(name, _LONG_AGO)
            entry.compress_type = zipfile.ZIP_DEFLATED
            package.writestr(entry, text)
    return packed.getvalue()


def _mesh(part: Part) -> Iterable[str]:
    nodes = part.vertices if part.beams is None else np.concatenate([part.vertices, part.beams.nodes])
    yield "   <mesh><vertices>"
    for x, y, z in nodes.tolist():
        yield f'<vertex x="{x:.9g}" y="{y:.9g}" z="{z:.9g}"/>'
    yield "   </vertices><triangles>"
    for a, b, c in part.triangles.tolist():
        yield f'<triangle v1="{a}" v2="{b}" v3="{c}"/>'
    yield "   </triangles>"
    if part.beams is not None:
        clip = "" if part.clipped_to is None else f' clippingmode="inside" clippingmesh="{part.clipped_to}"'
        radius = float(part.beams.radii.min())
        yield f'   <b:beamlattice minlength="0.0001" radius="{radius:.9g}" cap="sphere"{clip}><b:beams>'
        pairs = (part.beams.pairs + len(part.vertices)).tolist()
        for (a, b), (r, q) in zip(pairs, part.beams.radii.tolist(), strict=True):
            yield f'<b:beam v1="{a}" v2="{b}" r1="{r:.9g}" r2="{q:.9g}"/>'
        yield "   </b:beams></b:beamlattice>"
    yield "   </mesh>"


def read_3mf(content: bytes) -> tuple[dict[int, Part], list[int]]:
    """Objects of a 3MF file by their numbers, and the numbers of those to print; lengths in mm.

    Checked are the rules for which a reader may refuse a file: the parts and their types, one model in
    millimetres, required extensions, resources before they are used, indices within range, triangles of three
    vertices. Textures and transforms, which this module does not write, are not read. Raises InputError,
    which names the rule that is broken.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as package:
            types, relations = package.read("[Content_Types].xml"), package.read("_rels/.rels")
            target = _target(relations)
            _require(target in package.namelist(), f"its model {target!r} is missing")
            root = ElementTree.fromstring(package.read(target))
    except (zipfile.BadZipFile, KeyError, ElementTree.ParseError) as error:
        raise InputError(f"the file is not a 3MF package: {error}", "3MF", "write the file again") from error
    suffix = target.rpartition(".")[2]
    typed = {e.get("Extension"): e.get("ContentType") for e in ElementTree.fromstring(types)}
    _require(typed.get(suffix) == MODEL_TYPE, "its model has no content type")
    _require(root.tag == f"{{{CORE}}}model", "its model is of another namespace")
    _require(root.get("unit", "millimeter") == "millimeter", f"its unit is {root.get('unit')}")
    objects: dict[int, Part] = {}
    assembled: dict[int, list[int]] = {}
    for element in root.iterfind(f"{{{CORE}}}resources/{{{CORE}}}object"):
        number = int(element.get("id", "0"))
        _require(
            number > 0 and number not in objects and number not in assembled, "an object's number is taken"
        )
        mesh = element.find(f"{{{CORE}}}mesh")
        if mesh is not None:
            part = _part(element.get("name", ""), mesh)
            _require(
                part.clipped_to is None or part.clipped_to in objects,
                "a clipping mesh is defined after its use",
            )
            objects[number] = part
        else:
            used = [int(c.get("objectid", "0")) for c in element.iter(f"{{{CORE}}}component")]
            _require(
                bool(used) and all(u in objects or u in assembled for u in used), "a component is missing"
            )
            assembled[number] = used
    if any(part.beams is not None for part in objects.values()):
        _require(bool(root.get("requiredextensions")), "the beam lattice is not marked as required")
    printed = [int(item.get("objectid", "0")) for item in root.iterfind(f"{{{CORE}}}build/{{{CORE}}}item")]
    _require(
        bool(printed) and all(n in objects or n in assembled for n in printed), "the build list is empty"
    )
    return objects, [inner for number in printed for inner in assembled.get(number, [number])]


def _part(name: str, mesh: ElementTree.Element) -> Part:
    def numbers(path: str, *names: str) -> Array:
        rows = [[float(e.attrib[n]) for n in names] for e in mesh.iterfind(path)]
        return np.array(rows, dtype=float).reshape(-1, len(names))

    core = f"{{{CORE}}}"
    order = [child.tag.rpartition("}")[2] for child in mesh]
    _require(
        order in (["vertices", "triangles"], ["vertices", "triangles", "beamlattice"]),
        f"a mesh holds {order}",
    )
    vertices = numbers(f"{core}vertices/{core}vertex", "x", "y", "z")
    triangles = numbers(f"{core}triangles/{core}triangle", "v1", "v2", "v3").astype(np.int64)
    lattice = mesh.find(f"{{{BEAMS}}}beamlattice")
    _require(len(triangles) >= 4 or lattice is not None, "a mesh has fewer than four triangles")
    if len(triangles):
        _require(triangles.min() >= 0 and triangles.max() < len(vertices), "a triangle's vertex is missing")
        _require(bool((triangles != np.roll(triangles, 1, axis=1)).all()), "a triangle has a repeated vertex")
    if lattice is None:
        return Part(name, vertices, triangles)
    own = f"{{{BEAMS}}}beams/{{{BEAMS}}}beam"
    rows = [[float(e.attrib[n]) for n in ("v1", "v2", "r1", "r2")] for e in lattice.iterfind(own)]
    found = np.array(rows).reshape(-1, 4)
    pairs = found[:, :2].astype(np.int64)
    _require(
        len(pairs) > 0 and pairs.min() >= 0 and pairs.max() < len(vertices), "a beam's vertex is missing"
    )
    beams = Beams(vertices, pairs, found[:, 2:])
    _require(float(beams.lengths.min()) >= float(lattice.attrib["minlength"]), "a beam is too short")
    _require(bool((beams.radii > 0.0).all()), "a beam has no radius")
    clip = lattice.get("clippingmesh")
    return Part(name, vertices, triangles, beams, None if clip is None else int(clip))


def _target(relationships: bytes) -> str:
    found = [e for e in ElementTree.fromstring(relationships) if e.get("Type") == RELATIONSHIP]
    _require(len(found) == 1, f"it names {len(found)} models")
    return str(found[0].get("Target", "")).lstrip("/")


def _require(holds: bool, what: str) -> None:
    if not holds:
        raise InputError(f"the 3MF package is invalid: {what}", "3MF", "write the file again")
