"""Surfaces in files of other programs: STL, OBJ and PLY, read as points and triangles."""

from __future__ import annotations

import itertools
import re
from pathlib import PurePath
from typing import Any

import numpy as np

from ..errors import InputError
from .surface import Triangles, Vertices, stl_surface

SUFFIXES = (".stl", ".obj", ".ply")
_VERTEX = re.compile(r"(?<!\S)vertex(?!\S)")
_CORNER = re.compile(_VERTEX.pattern + r"\s+(\S+)\s+(\S+)\s+(\S+)")
# What files that are no mesh of ours begin with or are named: what they are, and what to do.
_CAD = "in the CAD program export the solid as STL, in mm, with a chord error of 0.05 mm or less"
_BLENDER = "open it in Blender and export the part as STL"
_OTHERS = (
    (
        b"; ",
        (".gcode", ".gco", ".bgcode", ".ufp", ".sl1", ".sl1s", ".ctb", ".cbddlp", ".photon", ".pwmx", ".goo"),
        "a job for a printer, sliced",
        "give the part that was sliced, as STL",
    ),
    (
        b"PK\x03\x04",
        (".3mf", ".amf"),
        "an archive, as a 3MF, or an AMF",
        "open it in a slicer and export the part as STL",
    ),
    (b"ISO-10303-21", (".step", ".stp"), "a STEP file", _CAD),
    (
        b"",
        (".iges", ".igs", ".brep", ".sldprt", ".ipt", ".f3d", ".fcstd", ".x_t", ".sat"),
        "a CAD file",
        _CAD,
    ),
    (b"glTF", (".glb", ".gltf"), "a glTF scene", _BLENDER),
    (b"Kaydara FBX", (".fbx", ".dae", ".usd", ".blend"), "a scene", _BLENDER),
    (b"version https://git-lfs", (), "a pointer of Git LFS", "fetch the file itself with git lfs pull"),
    (b"<", (".html", ".xml"), "a web page or XML", "download the file itself, or export the part as STL"),
)
_SOLID = re.compile(rb"(\xef\xbb\xbf)?\s*solid\s", re.IGNORECASE)
_POINT = re.compile(rb"(?:^|[\r\n])[ \t]*v[ \t]+[-+.\d]")
# Characters in which a decimal comma is searched.
_SHOWN = 1 << 16


def read_surface(content: bytes, name: str, most_triangles: int | None = None) -> tuple[Vertices, Triangles]:
    """Points (n, 3) and triangles (m, 3) of a file's content; polygons are triangulated in their plane.

    name: of the file; its suffix gives the type if the content does not. most_triangles: an STL file with
    more is refused before parsing. Raises InputError with the line or number at fault.
    """
    require_mesh(content[:64], name)
    kind = _kind(content) or PurePath(name).suffix.lower()
    if kind == ".obj":
        points, triangles = _obj(_text(content), name)
    elif kind == ".ply":
        points, triangles = _ply(content, name)
    else:
        return _stl(content, name, most_triangles)
    if len(triangles) and not 0 <= triangles.min() <= triangles.max() < len(points):
        raise _malformed(name, "a face names a point that the file does not have")
    return points, triangles


def require_mesh(content: bytes, name: str) -> None:
    """Raise InputError with a remedy for content or a name of a format that is known, but no mesh of ours."""
    suffix = PurePath(name).suffix.lower()
    named = [row for row in _OTHERS if suffix in row[1]]
    for _, _, what, remedy in named or [row for row in _OTHERS if row[0] and content.startswith(row[0])]:
        raise InputError(f"the file is {what}, not an STL, OBJ or PLY file", name, remedy)


def _kind(content: bytes) -> str:
    """Suffix of the content's type, "" if it is unknown."""
    if _binary_triangles(content) is not None or _SOLID.match(content):
        return ".stl"
    if content[:3] == b"ply":
        return ".ply"
    return ".obj" if _POINT.search(content[: 1 << 16]) and b"\0" not in content[:80] else ""


def _binary_triangles(content: bytes) -> int | None:
    """Number of triangles of a binary STL, which may end in a few other bytes; None for any other content."""
    count = int.from_bytes(content[80:84], "little")
    return count if len(content) >= 84 and 0 <= len(content) - 84 - 50 * count < 50 else None


def _text(content: bytes) -> str:
    """Text with any line ends; bytes that are not ASCII, in names, stay as they are."""
    return content.decode("utf-8-sig", "replace").replace("\r\n", "\n").replace("\r", "\n")


def _malformed(name: str, why: str) -> InputError:
    return InputError(f"the file is truncated or malformed: {why}", name, "export it again, whole")


def _require_points(text: str, name: str) -> None:
    """Raise InputError for a text whose numbers have decimal commas."""
    for number, line in enumerate(text[:_SHOWN].split("\n"), 1):
        if found := re.search(r"(?<![\d,])[-+]?\d+,\d+(?![\d,])", line):
            raise InputError(
                f"{found[0]!r} has a decimal comma",
                f"{name}, line {number}",
                "export it with decimal points (set the region of the program or the computer to English)",
            )


def _stl(content: bytes, name: str, most: int | None) -> tuple[Vertices, Triangles]:
    count = _binary_triangles(content)
    binary = count is not None
    if count is None:
        text = _text(content).lower()
        count = sum(1 for _ in _VERTEX.finditer(text)) // 3
    if most is not None and count > most:
        raise InputError(
            f"the STL file holds {count} triangles",
            name,
            f"simplify it to {most} at most, or check its parts one by one",
        )
    return stl_surface(content[: 84 + 50 * count]) if binary else _text_stl(text, name)


def _text_stl(text: str, name: str) -> tuple[Vertices, Triangles]:
    if not text.lstrip().startswith("solid"):
        raise _malformed(name, "its beginning or length is not that of an STL file")
    try:
        words = (float(word) for corner in _CORNER.finditer(text) for word in corner.groups())
        corners = np.fromiter(words, float).reshape(-1, 3)
        if len(corners) != sum(1 for _ in _VERTEX.finditer(text)) or len(corners) % 3:
            raise ValueError("a corner without its three numbers")
    except ValueError as error:
        _require_points(text, name)
        raise _malformed(name, str(error)) from error
    if not len(corners):
        raise InputError("the STL file holds no triangles", name, "export the part again")
    points, index = np.unique(corners, axis=0, return_inverse=True)
    return points, np.ravel(index).reshape(-1, 3).astype(np.int64)


def _obj(text: str, name: str) -> tuple[Vertices, Triangles]:
    """A Wavefront OBJ's points and faces: corners may have texture and normal, and count from the end."""
    points: list[list[float]] = []
    faces: list[list[int]] = []
    begun = ""
    for number, line in enumerate(text.split("\n"), 1):
        if line.endswith("\\"):
            begun += line[:-1] + " "
            continue
        words, begun = (begun + line).split("#")[0].split(), ""
        try:
            if words[:1] == ["v"]:
                x, y, z = map(float, words[1:4])
                points.append([x, y, z])
            elif words[:1] == ["f"]:
                corners = [int(word.split("/")[0]) for word in words[1:]]
                if len(corners) < 3 or 0 in corners:
                    raise ValueError("a face needs three corners or more, counted from 1")
                faces.append([c - 1 if c > 0 else len(points) + c for c in corners])
        except ValueError as error:
            _require_points(text, name)
            raise _malformed(name, f"line {number}: {error}") from error
    at = np.array(points, float).reshape(-1, 3)
    if any(not 0 <= c < len(at) for face in faces for c in face):
        raise _malformed(name, "a face names a point that the file does not have")
    return at, _triangles(at, faces)


def _triangles(points: Vertices, faces: list[list[int]]) -> Triangles:
    """Triangles (m, 3) of flat polygons, each given by its corners; they need not be convex."""
    from manifold3d import triangulate

    found: list[Any] = [np.empty((0, 3), np.int64)]
    for face in faces:
        if len(face) == 3:
            found.append([face])
            continue
        corners = points[face]
        # Newell's normal, whose length is twice the area.
        normal = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
        if not (np.isfinite(normal).all() and normal.any()):
            found.append([[face[0], *pair] for pair in itertools.pairwise(face[1:])])
            continue
        u = np.cross(np.eye(3)[np.abs(normal).argmin()], normal)
        v = np.cross(normal, u)
        flat = corners @ np.column_stack([u / np.linalg.norm(u), v / np.linalg.norm(v)])
        found.append(np.array(face)[np.asarray(triangulate([flat]), np.int64)])
    return np.concatenate([np.asarray(part, np.int64).reshape(-1, 3) for part in found])


def _ply(content: bytes, name: str) -> tuple[Vertices, Triangles]:
    """Points and faces of a PLY file, whatever other elements and properties it has, in any order."""
    end = content.find(b"end_header", 0, 1 << 16)
    if end < 0:
        raise _malformed(name, "the header of the PLY file does not end")
    header = _text(content[:end]).split("\n")
    body = content[end + len(b"end_header") :].lstrip(b" ")
    form = next((line[7:].split(" ")[0] for line in header if line.startswith("format ")), "")
    text = "\n" * (len(header) - 1) + _text(body[:_SHOWN]) if form == "ascii" else ""
    try:
        order = _ORDERS[form]
        elements = _ply_elements(header, order or "<f8")
        if order:
            body = body[2 if body.startswith(b"\r\n") else 1 :]
        else:
            body = np.array(body.split(), dtype=bytes).astype("<f8").tobytes()
        at, found = 0, {}
        for element, count, properties in elements:
            found[element], at = _ply_rows(body, at, count, properties)
        vertex, face = found["vertex"], found["face"]
        corners = face.get("vertex_indices", face.get("vertex_index"))
        if corners is not None and any(np.ndim(corner) != 1 for corner in corners[:1]):
            raise ValueError("the corners of a face are no list")
        if not len(vertex["x"]) or corners is None:
            raise ValueError("it has no points" if corners is not None else "its faces have no corners")
        points = np.column_stack([np.asarray(vertex[axis], float) for axis in "xyz"])
        faces = np.concatenate([*map(np.ravel, corners), []])
        if not np.array_equal(faces, np.floor(faces)):
            raise ValueError("a corner of a face is not a whole number")
        if len(faces) and not 0 <= faces.min() <= faces.max() < len(points):
            raise ValueError("a face names a point that the file does not have")
        return points, _triangles(points, [[int(c) for c in face] for face in corners if len(face) > 2])
    except KeyError as error:
        raise _malformed(name, f"its header names no {error}") from error
    except (ValueError, IndexError, OverflowError) as error:
        _require_points(text, name)
        raise _malformed(name, str(error) or "the PLY file is damaged") from error


_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_SIZES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
# A property: its name, the type of its count if it is a list, and its type.
_Property = tuple[str, str, str]


def _ply_elements(header: list[str], order: str) -> list[tuple[str, int, list[_Property]]]:
    """Elements of a PLY header: name, count and properties; order: of the bytes, or a type for all."""

    def type_of(name: str) -> str:
        return order if len(order) > 1 else order + _SIZES[name]

    elements: list[tuple[str, int, list[_Property]]] = []
    for words in map(str.split, header):
        if words[:1] == ["element"]:
            elements.append((words[1], int(words[2]), []))
        elif words[:2] == ["property", "list"]:
            if words[4].startswith("vertex_ind") and "f" in _SIZES[words[3]]:
                raise ValueError("a corner of a face is not a whole number")
            elements[-1][2].append((words[4], type_of(words[2]), type_of(words[3])))
        elif words[:1] == ["property"]:
            elements[-1][2].append((words[2], "", type_of(words[1])))
    if not all(properties for _, _, properties in elements):
        raise ValueError("an element of its header has no properties")
    return elements


def _ply_rows(body: bytes, at: int, count: int, properties: list[_Property]) -> tuple[dict[str, Any], int]:
    """Values of an element's properties by name, lists as sequences of rows, and the byte after them."""
    if not 0 <= count <= len(body):
        raise ValueError(f"it ends before {count} rows of an element")
    lengths = {}
    place = at
    for name, counted, type_ in properties if count else []:
        if counted:
            lengths[name] = int(np.frombuffer(body, counted, 1, place)[0])
            place += np.dtype(counted).itemsize
        place += np.dtype(type_).itemsize * lengths.get(name, 1)
    # All rows of the first one's lengths are read at once.
    fields: list[Any] = []
    for name, counted, type_ in properties:
        if counted:
            fields.append((f"length of {name}", counted))
        fields.append((name, type_, (lengths.get(name, 0),)) if counted else (name, type_))
    rows = np.dtype(fields)
    if len(body) - at >= rows.itemsize * count:
        table = np.frombuffer(body, rows, count, at)
        if all((table[f"length of {name}"] == length).all() for name, length in lengths.items()):
            return {name: table[name] for name, _, _ in properties}, at + rows.itemsize * count
    found: dict[str, list[Any]] = {name: [] for name, _, _ in properties}
    for _ in range(count):
        for name, counted, type_ in properties:
            length = 1
            if counted:
                length = int(np.frombuffer(body, counted, 1, at)[0])
                at += np.dtype(counted).itemsize
            values = np.frombuffer(body, type_, length, at)
            at += values.nbytes
            found[name].append(values if counted else values[0])
    return found, at
