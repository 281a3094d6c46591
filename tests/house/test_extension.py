"""The Blender extension: Blender's tool accepts it, it holds what ships, and it registers twice."""

import base64
import hashlib
import importlib.metadata
import importlib.util
import json
import re
import shutil
import struct
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
needs_bpy = pytest.mark.skipif(importlib.util.find_spec("bpy") is None, reason="bpy is not installed")


def ran(words, **more):
    """A finished process, and what it said."""
    return subprocess.run(words, capture_output=True, text=True, check=False, **more)


@pytest.fixture
def ci(monkeypatch):
    """Imports a module of .ci by name."""
    monkeypatch.syspath_prepend(ROOT / ".ci")
    return importlib.import_module


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    out = tmp_path_factory.mktemp("extension")
    done = ran([sys.executable, ROOT / ".ci" / "extension.py", out])
    assert done.returncode == 0, done.stdout + done.stderr
    assert "Success parsing TOML" in done.stdout
    (path,) = out.glob("*.zip")
    return path


@needs_bpy
def test_archive_holds_what_ships(archive):
    names = zipfile.ZipFile(archive).namelist()
    shipped = {"blender_manifest.toml", "__init__.py", "LICENSE", "errors.py", "report/report.css"}
    assert shipped | {"sbom.cdx.json"} <= set(names)
    bill = json.loads(zipfile.ZipFile(archive).read("sbom.cdx.json"))
    assert (bill["metadata"]["component"]["name"], bill["components"]) == ("mu_addon", [])
    for name in names:
        assert not name.startswith(("tests/", "docs/", "benchmarks/", "."))
        assert "__pycache__" not in name


@needs_bpy
def test_blender_refuses_a_bad_manifest(tmp_path, ci):
    extension = ci("extension")
    source = tmp_path / "mu_addon"
    extension.stage(source)
    manifest = source / "blender_manifest.toml"
    manifest.write_text(manifest.read_text().replace('tagline = "', 'tagline = "' + "x" * 64))
    tool = extension.blender_ext()
    done = ran([sys.executable, tool, "validate", source])
    assert done.returncode != 0
    assert "tagline" in done.stdout + done.stderr


def wheel(folder, name, metadata):
    """A wheel of a package that vendors another."""
    path = folder / f"{name}-1.2-py3-none-any.whl"
    with zipfile.ZipFile(path, "w") as stream:
        stream.writestr(f"{name}/_vendor/other-9.dist-info/METADATA", "Name: other\nVersion: 9\n")
        stream.writestr(f"{name}-1.2.dist-info/METADATA", f"Name: {name}\nVersion: 1.2\n{metadata}\n")
    return path


def test_the_bill_of_materials_names_every_wheel(tmp_path, ci):
    (tmp_path / "wheels").mkdir()
    shutil.copy(ROOT / "blender_manifest.toml", tmp_path)
    one = wheel(tmp_path / "wheels", "one_a", "License-Expression: MIT AND Zlib")
    wheel(tmp_path / "wheels", "three", "License: " + "All of its text, naïve " * 9)
    wheel(tmp_path / "wheels", "two", "License: x\nClassifier: License :: OSI Approved :: BSD License")
    ci("bill").write_bill(tmp_path)
    bill = json.loads((tmp_path / "sbom.cdx.json").read_text())
    assert (bill["bomFormat"], bill["specVersion"], bill["version"]) == ("CycloneDX", "1.6", 1)
    assert bill["metadata"]["component"]["licenses"] == [{"license": {"id": "GPL-3.0-or-later"}}]
    first, second, third = bill["components"]
    digest = hashlib.sha256(one.read_bytes()).hexdigest()
    assert (first["name"], first["version"]) == ("one_a", "1.2")
    assert first["purl"] == "pkg:pypi/one-a@1.2?file_name=one_a-1.2-py3-none-any.whl"
    assert first["hashes"] == [{"alg": "SHA-256", "content": digest}]
    assert first["licenses"] == [{"expression": "MIT AND Zlib"}]
    assert "licenses" not in second
    assert third["licenses"] == [{"license": {"name": "BSD License"}}]
    references = [c["bom-ref"] for c in bill["components"]]
    assert bill["dependencies"] == [{"ref": "mu_addon", "dependsOn": references}]


def test_an_archive_with_other_wheels_than_pinned_is_refused(tmp_path, ci):
    wheels = ci("wheels")
    content = {name: f"content of {name}".encode() for name in ("a.whl", "b.whl", "c.whl")}
    pins = [
        wheels.Wheel("linux-x64", "3.11", name[0], "1", name, hashlib.sha256(data).hexdigest())
        for name, data in content.items()
    ]

    assert wheels.not_as_pinned(archive_of(tmp_path, content), pins, tmp_path) == []
    other = {"a.whl": content["a.whl"], "b.whl": b"another", "d.whl": b"one more"}
    assert wheels.not_as_pinned(archive_of(tmp_path, other), pins, tmp_path) == [
        "wheels/d.whl is not pinned in wheels.csv",
        "wheels/c.whl is missing",
        "wheels/b.whl has another SHA-256 than pinned",
    ]


def archive_of(folder, held):
    """An extension's archive with these wheels, by name."""
    path = folder / "built.zip"
    with zipfile.ZipFile(path, "w") as stream:
        for name, data in held.items():
            stream.writestr(f"wheels/{name}", data)
    return path


SCIPY = {
    "scipy/linalg/__init__.py": "x = 1\n",
    "scipy/linalg/_large.py": "y = 2\n" * 999,
    "scipy/linalg/tests/test_lapack.py": "assert True\n",
    "scipy/linalg/tests/data/LICENSE.txt": "free\n",
    "scipy-9.dist-info/METADATA": "Name: scipy\nVersion: 9\nLicense-Expression: BSD-3-Clause\n",
    "scipy-9.dist-info/WHEEL": "Wheel-Version: 1.0\nTag: py3-none-any\n",
}
NAME = "scipy-9-py3-none-any.whl"


def digest(content):
    return base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()


@pytest.fixture
def published(tmp_path):
    """A wheel of a package that ships its tests, where a download lies."""
    path = tmp_path / "linux-x64" / "3.11" / NAME
    path.parent.mkdir(parents=True)
    return with_record(path, SCIPY, "scipy-9.dist-info/RECORD")


def with_record(path, files, record):
    """A wheel of these files, by name, with its record of them."""
    files = {name: held if isinstance(held, bytes) else held.encode() for name, held in files.items()}
    rows = [f"{name},sha256={digest(held)},{len(held)}\n" for name, held in files.items()]
    with zipfile.ZipFile(path, "w") as stream:
        for name, held in (files | {record: "".join(rows) + f"{record},,\n"}).items():
            stream.writestr(name, held)
    return path


def test_a_slimmed_wheel_lacks_its_tests_and_nothing_else(tmp_path, ci, published):
    made, change = ci("slim").slim(published, tmp_path / "slim")
    again, _ = ci("slim").slim(published, tmp_path / "again")
    assert made.read_bytes() == again.read_bytes()
    assert made.name == "scipy-9-0slim-py3-none-any.whl"
    assert (change.original, change.files) == (NAME, 1)
    assert change.sha256 == hashlib.sha256(published.read_bytes()).hexdigest()
    with zipfile.ZipFile(made) as package:
        held = {name: package.read(name) for name in package.namelist()}
        assert package.getinfo("scipy/linalg/_large.py").compress_type == zipfile.ZIP_LZMA
    rows = [line.split(",") for line in held.pop("scipy-9.dist-info/RECORD").decode().splitlines()]
    assert rows.pop() == ["scipy-9.dist-info/RECORD", "", ""]
    assert {name for name, *_ in rows} == held.keys() == SCIPY.keys() - {"scipy/linalg/tests/test_lapack.py"}
    for name, code, size in rows:
        assert (code, int(size)) == (f"sha256={digest(held[name])}", len(held[name]))
        assert name.endswith("/WHEEL") or held[name].decode() == SCIPY[name]
    assert held["scipy-9.dist-info/WHEEL"].decode() == SCIPY["scipy-9.dist-info/WHEEL"] + "Build: 0slim\n"


def test_another_change_of_a_slimmed_wheel_is_refused(tmp_path, ci, published):
    wheels = ci("wheels")
    pin = wheels.Wheel(
        "linux-x64", "3.11", "scipy", "9", NAME, hashlib.sha256(published.read_bytes()).hexdigest()
    )
    made, _ = ci("slim").slim(published, tmp_path / "slim")
    assert wheels.not_as_pinned(archive_of(tmp_path, {made.name: made.read_bytes()}), [pin], tmp_path) == []
    with zipfile.ZipFile(made) as package:
        held = {name: package.read(name) for name in package.namelist()}
    held["scipy/linalg/__init__.py"] = b"x = 2\n"
    held["scipy/more.py"] = held.pop("scipy-9.dist-info/METADATA")
    with zipfile.ZipFile(made, "w") as package:
        for name, content in held.items():
            package.writestr(name, content)
    assert wheels.not_as_pinned(archive_of(tmp_path, {made.name: made.read_bytes()}), [pin], tmp_path) == [
        f"wheels/{made.name}: scipy/more.py was added",
        f"wheels/{made.name}: scipy-9.dist-info/METADATA was lost",
        f"wheels/{made.name}: scipy/linalg/__init__.py was changed",
    ]
    # What the wheel was made from has to be the pinned one, too.
    published.write_bytes(published.read_bytes() + b"x")
    found = wheels.not_as_pinned(archive_of(tmp_path, {made.name: made.read_bytes()}), [pin], tmp_path)
    assert f"wheels/{made.name} has another SHA-256 than pinned" in found


class Segment(NamedTuple):
    """A part of a library as its loader is told of it."""

    kind: int
    flags: int
    offset: int
    address: int
    physical: int
    held: int
    taken: int
    align: int


def segments(content):
    """A library's segments, and where the list of them lies."""
    (table,) = struct.unpack_from("<Q", content, 0x20)
    size, count = struct.unpack_from("<HH", content, 0x36)
    listed = [Segment(*struct.unpack_from("<IIQQQQQQ", content, table + size * k)) for k in range(count)]
    return listed, slice(table, table + size * count)


LOADED = """
import importlib.util, sys
spec = importlib.util.spec_from_file_location(*sys.argv[1:])
module = importlib.util.module_from_spec(spec)
spec.loader.exec_module(module)
print(len(dir(module)))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="ELF libraries")
@pytest.mark.parametrize("name", ["kiwisolver._cext", "PIL._imaging", "cvxopt.base"])
def test_a_library_without_what_no_loader_reads_has_the_same_segments_and_loads(name, tmp_path, ci):
    elf = ci("elf")
    file = Path(importlib.util.find_spec(name).origin)
    published = file.read_bytes()
    made = elf.loaded(published)
    assert len(made) < 0.8 * len(published)
    assert (elf.loaded(made), elf.loaded(b"no library")) == (made, b"no library")
    blank = []
    for content in (published, made):
        whole, (_, table) = bytearray(content), segments(content)
        whole[table] = bytes(table.stop - table.start)
        whole[:64] = bytes(64)
        blank.append(whole)
    for before, after in zip(segments(published)[0], segments(made)[0], strict=True):
        assert after._replace(offset=before.offset, align=before.align) == before
        assert after.kind != 1 or (after.address - after.offset) % after.align == 0
        held = [
            whole[part.offset : part.offset + part.held]
            for whole, part in zip(blank, (before, after), strict=True)
        ]
        assert held[0] == held[1]
    # Beside the libraries that it asks for by a place relative to its own.
    root = file.parents[name.count(".")]
    for libraries in root.glob(f"{file.parent.name.lower().replace('pil', 'pillow')}.libs"):
        (tmp_path / libraries.name).symlink_to(libraries)
    copy = tmp_path / file.relative_to(root)
    copy.parent.mkdir()
    found = []
    for content in (published, made):
        copy.write_bytes(content)
        done = ran([sys.executable, "-c", LOADED, name, copy])
        assert done.returncode == 0, done.stderr
        found.append(done.stdout)
    assert found[0] == found[1]


@pytest.mark.skipif(sys.platform != "linux", reason="ELF libraries")
def test_a_slimmed_wheel_has_its_libraries_as_the_loader_reads_them(tmp_path, ci, published):
    content = Path(importlib.util.find_spec("kiwisolver._cext").origin).read_bytes()
    with_record(published, {**SCIPY, "scipy/linalg/_flapack.so": content}, "scipy-9.dist-info/RECORD")
    made, change = ci("slim").slim(published, tmp_path / "slim")
    assert change.shortened == 1
    shorter = ci("elf").loaded(content)
    with zipfile.ZipFile(made) as package, zipfile.ZipFile(published) as original:
        rows = package.read("scipy-9.dist-info/RECORD").decode().splitlines()
        assert f"scipy/linalg/_flapack.so,sha256={digest(shorter)},{len(shorter)}" in rows
        assert ci("slim").differences(package, original) == []
        assert ci("slim").differences(original, original)[-1] == "scipy/linalg/_flapack.so was changed"


@pytest.mark.skipif(sys.platform != "linux", reason="ELF libraries")
def test_a_library_that_another_asks_for_is_not_left_out(tmp_path, ci, published):
    content = Path(importlib.util.find_spec("cvxopt.base").origin).read_bytes()
    asked = next(name for name in ci("elf").libraries(content) if "blas" in name)
    files = {"scipy/linalg/base.so": content, f"scipy/tests/{asked}": "a library"}
    with_record(published, {**SCIPY, **files}, "scipy-9.dist-info/RECORD")
    with pytest.raises(RuntimeError, match=rf"base\.so asks for scipy/tests/{re.escape(asked)}, which"):
        ci("slim").slim(published, tmp_path / "slim")


@pytest.mark.skipif(sys.platform != "linux", reason="ELF libraries")
def test_a_library_whose_names_another_has_is_struck_and_left_out(tmp_path, ci, published):
    """cvxopt's own: the loader takes CHOLMOD's BLAS from OpenBLAS, and nothing from ATLAS."""
    elf, slim = ci("elf"), ci("slim")
    site = Path(importlib.util.find_spec("cvxopt").origin).parents[1]
    files = [*site.glob("cvxopt/cholmod.*.so"), *site.glob("cvxopt.libs/lib*")]
    files = {str(file.relative_to(site)): file.read_bytes() for file in files}
    whole = published.with_name("cvxopt-1.3.3-py3-none-any.whl")
    named = {
        name.replace("scipy-9", "cvxopt-1.3.3"): text for name, text in SCIPY.items() if "dist-info" in name
    }
    with_record(whole, {**named, **files}, "cvxopt-1.3.3.dist-info/RECORD")
    made, _ = slim.slim(whole, tmp_path / "slim")
    with zipfile.ZipFile(made) as package, zipfile.ZipFile(whole) as original:
        assert slim.differences(package, original) == []
        names = package.namelist()
        (cholmod,) = (name for name in names if "libcholmod" in name)
        left = elf.libraries(original.read(cholmod))
        # What the loader reads has no sections: the same table, read before they went.
        struck = elf.struck(original.read(cholmod), {name for name in left if "satlas" in name})
    assert not [name for name in names if "satlas" in name]
    assert [name for name in left if "satlas" not in name] == elf.libraries(struck)
    without = {name: content for name, content in files.items() if "openblas" not in name}
    with_record(whole, {**named, **without}, "cvxopt-1.3.3.dist-info/RECORD")
    with pytest.raises(RuntimeError, match=r"asks for cvxopt\.libs/libsatlas"):
        slim.slim(whole, tmp_path / "slim")


WARP = {
    "warp/bin/warp.so": "all of it",
    "warp/native/warp.cpp": "int x;",
    "warp_lang-1.dist-info/METADATA": "Name: warp-lang\nVersion: 1\n",
    "warp_lang-1.dist-info/WHEEL": "Wheel-Version: 1.0\n",
}


def test_warps_library_is_replaced_by_the_pinned_one_alone(tmp_path, ci, published, monkeypatch):
    slim, wheels, bill = ci("slim"), ci("wheels"), ci("bill")
    whole = published.with_name("warp_lang-1-py3-none-any.whl")
    with_record(whole, WARP, "warp_lang-1.dist-info/RECORD")
    sha = hashlib.sha256(whole.read_bytes()).hexdigest()
    pin = wheels.Wheel("linux-x64", "3.11", "warp-lang", "1", whole.name, sha)
    library = b"for the processor"
    monkeypatch.setattr(wheels.warp_cpu, "SHA256", hashlib.sha256(library).hexdigest())
    made, change = slim.slim(whole, tmp_path / "slim", {"warp/bin/warp.so": library})
    held = {made.name: made.read_bytes()}
    with zipfile.ZipFile(made) as package:
        assert package.read("warp/bin/warp.so") == library
        rows = package.read("warp_lang-1.dist-info/RECORD").decode().splitlines()
    assert f"warp/bin/warp.so,sha256={digest(library)},{len(library)}" in rows
    assert wheels.not_as_pinned(archive_of(tmp_path, held), [pin], tmp_path) == []
    # With CUDA the published library has to be there, and no other is taken for the pinned one.
    (wrong,) = wheels.not_as_pinned(archive_of(tmp_path, held), [pin], tmp_path, cuda=True)
    assert wrong == f"wheels/{made.name}: warp/bin/warp.so was changed"
    other, _ = slim.slim(whole, tmp_path / "slim", {"warp/bin/warp.so": b"another"})
    (wrong,) = wheels.not_as_pinned(archive_of(tmp_path, {other.name: other.read_bytes()}), [pin], tmp_path)
    assert wrong == f"wheels/{made.name}: warp/bin/warp.so has another SHA-256 than pinned"
    shutil.copy(ROOT / "blender_manifest.toml", tmp_path)
    slim.slim(whole, tmp_path / "wheels", {"warp/bin/warp.so": library})
    bill.write_bill(tmp_path, [change])
    (component,) = json.loads((tmp_path / "sbom.cdx.json").read_text())["components"]
    assert "warp/bin/warp.so compiled anew" in component["pedigree"]["notes"]


@pytest.mark.skipif(sys.platform != "linux", reason="an ELF library")
def test_warps_library_for_the_processor_refuses_what_it_lacks(ci):
    warp_cpu = ci("warp_cpu")
    folder = Path(importlib.util.find_spec("warp").origin).parent
    names = ci("elf").exported((folder / "bin" / "warp.so").read_bytes())
    assert {"wp_init", "wp_volume_create_host", "wp_nanovdb_version", "wp_mesh_create_host"} <= names
    assert all(name.startswith("wp_") for name in names)
    lines = warp_cpu.refusals({n for n in names if n.startswith("wp_volume_")}).splitlines()
    assert len(lines) == 1 + len({n for n in names if n.startswith("wp_volume_")})
    assert 'wp_volume_create_host() { wp::set_error_string("wp_volume_create_host: ' in "".join(lines)
    # What is compiled lies in the wheel, without the sources that need what it lacks.
    sources = {p.name for p in (folder / "native").glob("*.cpp")}
    assert {"warp.cpp", "mesh.cpp", "bvh_cubql.cpp", *warp_cpu._VOLUMES} <= sources


def gmsh_library():
    """gmsh's own library as its wheel installs it: None on another system than Linux."""
    (files,) = [importlib.metadata.files("gmsh")]
    return next((f.locate() for f in files if f.name.startswith("libgmsh.so")), None)


@pytest.mark.skipif(gmsh_library() is None, reason="gmsh's library for Linux")
def test_gmshs_library_asks_for_no_window_and_is_otherwise_the_same(ci):
    elf, gmsh_window = ci("elf"), ci("gmsh_window")
    published = gmsh_library().read_bytes()
    made = gmsh_window.without_window(published)
    assert hashlib.sha256(made).hexdigest() == gmsh_window.SHA256
    asked = {library.name for library in elf.needed(published)}
    struck = asked - {library.name for library in elf.needed(made)}
    assert {"libGLU.so.1", "libXft.so.2", "libXcursor.so.1", "libXinerama.so.1"} <= struck
    assert asked - struck >= {"libc.so.6", "libm.so.6", "libgomp.so.1", "libstdc++.so.6"}
    weakened = {s.name for s in elf.symbols(made) if made[s.at + 4] != published[s.at + 4]}
    assert {"gluSphere", "glBegin", "XftFontOpen", "XOpenDisplay", "FcPatternDestroy"} <= weakened
    assert not weakened & elf.exported(published)
    table = elf.dynamic(published)[0]
    changed = np.flatnonzero(np.frombuffer(made, "u1") != np.frombuffer(published, "u1"))
    outside = (changed < table.offset) | (changed >= table.offset + table.size)
    assert int(outside.sum()) == len(weakened)


STEP = """
import sys
import gmsh
gmsh.initialize()
gmsh.model.occ.addBox(0, 0, 0, 1, 2, 3)
gmsh.model.occ.synchronize()
gmsh.write("box.step")
gmsh.model.mesh.generate(3)
print(len(gmsh.model.mesh.getNodes()[0]))
files = {line.split("/")[-1].strip() for line in open("/proc/self/maps")}
print(sorted(name for name in files if name.startswith(("libX", "libGL", "libfontconfig", "libgmsh"))))
"""


@pytest.mark.skipif(gmsh_library() is None, reason="gmsh's library for Linux")
def test_gmsh_without_its_window_loads_none_of_its_libraries_and_writes_step(tmp_path, ci):
    made = tmp_path / gmsh_library().name
    made.write_bytes(ci("gmsh_window").without_window(gmsh_library().read_bytes()))
    # gmsh takes the library that lies beside its module. The loader reads all names at once.
    shutil.copy(importlib.util.find_spec("gmsh").origin, tmp_path)
    done = ran([sys.executable, "-c", STEP], cwd=tmp_path, env={"PYTHONPATH": str(tmp_path), "PATH": ""})
    assert done.returncode == 0, done.stdout + done.stderr
    nodes, files = done.stdout.splitlines()[-2:]
    assert (int(nodes) > 8, files) == (True, f"['{made.name}']")
    assert "CLOSED_SHELL" in (tmp_path / "box.step").read_text()


def test_a_library_of_other_bytes_than_pinned_is_refused(tmp_path, ci, monkeypatch):
    warp_cpu = ci("warp_cpu")
    made = []

    def compiled(wheel, packages):
        made.append(wheel)
        return b"what came out"

    monkeypatch.setattr(warp_cpu, "_compiler", lambda folder: folder)
    monkeypatch.setattr(warp_cpu, "_compiled", compiled)
    with pytest.raises(RuntimeError, match=r"has SHA-256 .*, pinned is"):
        warp_cpu.library(tmp_path / "warp.whl", tmp_path)
    monkeypatch.setattr(warp_cpu, "SHA256", hashlib.sha256(b"what came out").hexdigest())
    for _ in range(2):
        assert warp_cpu.library(tmp_path / "warp.whl", tmp_path) == b"what came out"
    assert len(made) == 1, "the one that was refused is the pinned one now, and is kept"


def test_the_bill_says_what_a_slimmed_wheel_was_made_from(tmp_path, ci, published):
    shutil.copy(ROOT / "blender_manifest.toml", tmp_path)
    made, change = ci("slim").slim(published, tmp_path / "wheels")
    ci("bill").write_bill(tmp_path, [change])
    (component,) = json.loads((tmp_path / "sbom.cdx.json").read_text())["components"]
    assert "purl" not in component
    assert component["hashes"][0]["content"] == hashlib.sha256(made.read_bytes()).hexdigest()
    (ancestor,) = component["pedigree"]["ancestors"]
    assert ancestor["purl"] == f"pkg:pypi/scipy@9?file_name={NAME}"
    assert ancestor["hashes"][0]["content"] == change.sha256
    assert "1 files, 12 bytes, left out: */tests/*" in component["pedigree"]["notes"]


@pytest.mark.parametrize(
    ("python", "first", "end"), [("3.11", "4.5.0", "5.1.0"), ("3.13", "5.1.0", None), ("3.14", "5.1.0", None)]
)
def test_an_archive_is_for_the_blenders_of_its_python(python, first, end, tmp_path, ci, published):
    shutil.copy(ROOT / "blender_manifest.toml", tmp_path)
    ci("extension").bundle(tmp_path, [published], "linux-x64", python)
    manifest = tomllib.loads((tmp_path / "blender_manifest.toml").read_text())
    assert (manifest["blender_version_min"], manifest.get("blender_version_max")) == (first, end)
    assert (manifest["platforms"], manifest["wheels"]) == (["linux-x64"], [f"./wheels/{NAME}"])
    assert manifest["permissions"]


def test_pins_are_those_of_the_project(ci):
    """After a change of the dependencies: `python .ci/wheels.py`."""
    wheels = ci("wheels")
    pinned = wheels.pinned()
    digests = {}
    for wheel in pinned:
        assert re.fullmatch("[0-9a-f]{64}", wheel.sha256)
        assert wheel.file.endswith(".whl")
        assert digests.setdefault(wheel.file, wheel.sha256) == wheel.sha256
    named = {(w.platform, w.python, w.name.lower().replace("_", "-"), w.version) for w in pinned}
    for platform in wheels.PLATFORMS:
        for python in wheels.PYTHONS:
            for requirement in wheels.requirements(platform):
                name, version = requirement.split("==")
                assert (platform, python, name, version) in named
    assert not {"numpy", "bpy"} & {w.name for w in pinned}


def test_without_bpy_it_says_what_to_do_before_any_work(tmp_path):
    out = tmp_path / "out"
    # Without site-packages there is no bpy, as after a plain `pip install -e .`.
    done = ran([sys.executable, "-S", ROOT / ".ci" / "extension.py", out])
    assert done.returncode == 2
    assert "bpy==" in done.stderr
    assert "--install" in done.stderr or "use python3.11" in done.stderr
    assert not out.exists()


INSTALL = """
import sys
import bpy

bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.extensions.package_install_files(filepath=sys.argv[1], repo="user_default", enable_on_install=True)
name = "bl_ext.user_default.mu_addon"
assert name in bpy.context.preferences.addons, list(bpy.context.preferences.addons.keys())
module = sys.modules[name]
for _ in range(2):
    module.unregister()
    module.register()
from bl_ext.user_default.mu_addon.design.parameters import load_preset
assert load_preset("mu-1.0x").dimensions.cell == 12.5
assert "mu_addon" not in sys.modules, "the core was imported under a second name"
print("registered")
"""


@needs_bpy
def test_installs_and_registers_twice(archive, tmp_path):
    done = ran(
        [sys.executable, "-c", INSTALL, archive],
        cwd=tmp_path,
        env={"PATH": "", "HOME": str(tmp_path), "BLENDER_USER_RESOURCES": str(tmp_path / "blender")},
    )
    assert "registered" in done.stdout, done.stdout + done.stderr
