"""Surfaces as other programs write them: one L-shaped column of 3 by 3 by 2 mm, in every dialect."""

import struct

import numpy as np
import pytest

from mu_addon.design.surface import stl_bytes, volume, weld
from mu_addon.design.surface_reading import read_surface
from mu_addon.errors import InputError

OUTLINE = [(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)]
POINTS = [(x, y, z) for z in (0, 2) for x, y in OUTLINE]
N = len(OUTLINE)
# Ends of six corners, which are not convex, and sides of four.
FACES = [
    [*range(N)][::-1],
    [*range(N, 2 * N)],
    *([i, (i + 1) % N, N + (i + 1) % N, N + i] for i in range(N)),
]
VOLUME = 5 * 2


def obj(corner="{0}", vertex="v {0} {1} {2}", extra=""):
    lines = ["# by hand", "mtllib none.mtl", "o L", *(vertex.format(*p) for p in POINTS), extra]
    return "\n".join([*lines, *("f " + " ".join(corner.format(c + 1) for c in f) for f in FACES)]) + "\n"


def stl(corners):
    facets = "".join(
        "facet normal 0 0 0\n outer loop\n"
        + "".join(f"  vertex {x:e} {y:e} {z:e}\n" for x, y, z in triangle)
        + " endloop\nendfacet\n"
        for triangle in corners
    )
    return f"solid part of mine\n{facets}endsolid\n"


CORNERS = np.array(POINTS, float)[read_surface(obj().encode(), "a.obj")[1]]
TEXTURED = "vt 0.5 0.5\nvn 0 0 1"


def ply(form="ascii", faces="vertex_indices"):
    head = f"ply\nformat {form} 1.0\ncomment x\nelement vertex {2 * N}\nproperty float x\nproperty float y\n"
    head += f"property float z\nelement face {len(FACES)}\nproperty list uchar int {faces}\nend_header\n"
    if form == "ascii":
        rows = [" ".join(map(str, p)) for p in POINTS] + [" ".join(map(str, [len(f), *f])) for f in FACES]
        return (head + "\n".join(rows) + "\n").encode()
    body = b"".join(struct.pack("<3f", *p) for p in POINTS)
    return head.encode() + body + b"".join(struct.pack(f"<B{len(f)}i", len(f), *f) for f in FACES)


def rich_ply(form):
    """Other elements first and between, normals before places, doubles; a face has another list."""
    head = (
        f"ply\nformat {form} 1.0\nobj_info by hand\ncomment TextureFile none.jpg\nelement material 2\n"
        "property uchar red\n"
        f"property list uchar ushort names\nelement vertex {2 * N}\nproperty float nx\nproperty float64 x\n"
        f"property double y\nproperty float64 z\nproperty uint8 red\nelement edge 1\nproperty int vertex1\n"
        f"element face {len(FACES)}\nproperty uchar material\nproperty list int8 uint32 vertex_indices\n"
        "property list uchar float texcoord\nproperty short flags\nend_header\n"
    )
    rows = [("BB2H", 1, 2, 5, 6), ("BB", 1, 0), *(("fdddB", 0.5, *p, 255) for p in POINTS), ("i", 3)]
    rows += [(f"Bb{len(f)}IB2fh", 1, len(f), *f, 2, 0.5, 0.25, -1) for f in FACES]
    if form == "ascii":
        return (head + "\n".join(" ".join(map(str, row[1:])) for row in rows)).encode()
    order = "<" if "little" in form else ">"
    return head.encode() + b"".join(struct.pack(order + row[0], *row[1:]) for row in rows)


def from_the_end():
    lines = obj().split("\n")
    count = len(POINTS)
    turned = [
        "f " + " ".join(str(int(c) - 1 - count) for c in line.split()[1:]) if line.startswith("f ") else line
        for line in lines
    ]
    return "\n".join(turned)


FILES = {
    "plain.obj": obj(),
    "textured.obj": obj("{0}/1", extra=TEXTURED),
    "normals.obj": obj("{0}//1", extra=TEXTURED),
    "both.obj": obj("{0}/1/1", extra=TEXTURED),
    "colours.obj": obj(vertex="v {0} {1} {2} 0.5 0.25 1.0"),
    "weights.obj": obj(vertex="v {0} {1} {2} 1.0"),
    "negative.obj": from_the_end(),
    "continued.obj": obj().replace("f 6 5 4", "f 6 5 \\\n  4"),
    "indented.obj": "\n".join(f"  {line}  # said" for line in obj().split("\n")),
    "windows.obj": "\ufeff" + obj().replace("\n", "\r\n"),
    "mac.obj": obj().replace("\n", "\r"),
    "text.stl": stl(CORNERS),
    "capitals.stl": stl(CORNERS).upper(),
    "mac.stl": stl(CORNERS).replace("\n", "\r"),
    "marked.stl": "\ufeff" + stl(CORNERS),
    "blank.stl": "\n" + stl(CORNERS).replace("endsolid", "\n\nendsolid"),
    "of another type.obj": stl(CORNERS),
    "of another type.stl": obj(),
    "with a tail.stl": stl_bytes(CORNERS.reshape(-1, 3), np.arange(CORNERS.size // 3).reshape(-1, 3))
    + bytes(7),
    "ascii.ply": ply(),
    "windows.ply": ply().replace(b"\n", b"\r\n"),
    "index.ply": ply(faces="vertex_index"),
    "binary.ply": ply("binary_little_endian"),
    **{f"rich {form}.ply": rich_ply(form) for form in ("ascii", "binary_little_endian", "binary_big_endian")},
}


@pytest.mark.parametrize("name", FILES)
def test_every_dialect_brings_the_same_column(name):
    content = FILES[name] if isinstance(FILES[name], bytes) else FILES[name].encode()
    points, triangles = weld(*read_surface(content, name), 1e-6)
    assert len(points) == 2 * N
    assert len(triangles) == 2 * (N - 2) + 2 * N
    assert volume(points, triangles) == pytest.approx(VOLUME, rel=1e-6)
    # The ends are not convex: fans over their corners would cover what is outside.
    corners = points[triangles]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    assert areas.sum() == pytest.approx(2 * 5 + 12 * 2, rel=1e-6)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.obj", "v 0 0 0\nv 1 0\n", "line 2"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n\nf 1 2 x\n", "line 5"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "counted from 1"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "a point that the file does not have"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n", "a point that the file does not have"),
        ("a.stl", stl(CORNERS)[:-60], "corner"),
        ("a.stl", stl(CORNERS).replace(".", ","), "has a decimal comma"),
        ("a.obj", obj().replace("v 3 0 0", "v 3,5 0,0 0,0"), "'3,5' has a decimal comma"),
        ("a.ply", ply().decode().replace("3 0 0\n", "3,5 0,0 0,0\n"), "'3,5' has a decimal comma\n.*line 12"),
        ("a.ply", ply().decode().replace("float z", "float w"), "names no 'z'"),
        ("a.ply", ply().decode().replace("element face", "element tristrips"), "names no 'face'"),
        ("a.stl", "triangles of mine", "not that of an STL file"),
        ("a.ply", ply().decode()[:-20], "truncated or malformed"),
        ("a.ply", ply().decode().replace("element face", "element edge 2\nelement face"), "no properties"),
        (
            "a.ply",
            ply().decode().replace("end_header", "element edge 2\ncomment x\nend_header"),
            "no properties",
        ),
    ],
)
def test_what_is_damaged_is_refused_and_not_half_read(name, text, words):
    with pytest.raises(InputError, match=words):
        read_surface(text.encode(), name)
