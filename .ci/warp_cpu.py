"""Warp's library without CUDA, compiled from the sources that its wheel for Linux ships.

The published warp.so is 299 MB, nearly all of it a compiler for CUDA; without that it is 1.4 MB. Warp's own
switches leave CUDA out. The wheel lacks the headers that sparse volumes and cuBQL's trees need, which
nothing here uses: asked for them, the library says that it was built without them. It exports every name of
the published one.

The compiler is Zig's from PyPI (Clang), pinned by SHA-256: it brings its own C++ library and the symbols of
an old glibc, so that the library runs wherever the wheel does, and gives the same bytes on every machine.
Their SHA-256 is pinned, too.
"""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import elf

FILE = "warp/bin/warp.so"
"""The library in Warp's wheel."""
SHA256 = "dce0c8c4b9dd783702e9ac6e7223680c7427fbf7fa2252f743ffa3e299d982a6"
"""Of the library that is made from the wheel pinned in wheels.csv."""
CHANGE = "compiled anew from this wheel's sources without CUDA"
"""What is said of it in the bill of materials."""
COMPILER = "ziglang==0.17.0"
COMPILERS = (
    "97079827064a7492cce5541ceb438ae8003ce1e54e399676da2d62fb7a5dc08b",
    "d2804f94f54f7fcf8169f4b212a619ad688a4e2e6592e976f0cf2e58e2cd8af3",
)
"""Its wheels for Linux, x86_64 and aarch64."""
TARGET = "x86_64-linux-gnu.2.28"
"""The glibc that Warp's wheel asks for, manylinux_2_28."""
SWITCHES = (
    *("-mcpu=baseline", "-std=c++17", "-O3", "-DNDEBUG", "-fno-rtti", "-fPIC", "-fvisibility=hidden"),
    *("-DWP_BUILD_DLL", "-DWP_ENABLE_CUDA=0", "-DWP_ENABLE_MATHDX=0", "-DWP_ENABLE_CUDA_COMPATIBILITY=0"),
    *("-DWP_ENABLE_DEBUG=0", "-DWP_DISABLE_CUBQL", "-I."),
)
_NATIVE = "warp/native/"
_VOLUMES = ("volume.cpp", "volume_builder.cpp")
_REFUSED = ("wp_volume_", "wp_nanovdb_")
_EXPORTS = "{ global: wp_*; local: *; };\n"


def library(wheel: Path, folder: Path) -> bytes:
    """The library for the processor alone; raises RuntimeError where it is not the one pinned.

    It is kept in `folder`, beside the compiler. Raises CalledProcessError where the compiler fails.
    """
    kept = folder / f"{wheel.stem}-{Path(FILE).name}"
    if not kept.is_file() or hashlib.sha256(kept.read_bytes()).hexdigest() != SHA256:
        kept.write_bytes(_compiled(wheel, _compiler(folder)))
    content = kept.read_bytes()
    digest = hashlib.sha256(content).hexdigest()
    if digest != SHA256:
        raise RuntimeError(f"{kept} has SHA-256 {digest}, pinned is {SHA256} (warp_cpu.py)")
    return content


def refusals(names: set[str]) -> str:
    """C++ of the functions that are left out, each of which says so and returns 0."""
    head = "namespace wp { void set_error_string(const char*, ...); }\n"
    line = (
        'extern "C" __attribute__((visibility("default"))) unsigned long {0}()'
        ' {{ wp::set_error_string("{0}: this Warp is built without volumes"); return 0; }}\n'
    )
    return head + "".join(line.format(name) for name in sorted(names))


def _compiler(folder: Path) -> Path:
    """A folder of packages with the compiler; pip refuses any but the pinned one."""
    packages = folder / COMPILER
    if not packages.is_dir():
        listed = folder / "compiler.txt"
        folder.mkdir(parents=True, exist_ok=True)
        listed.write_text(COMPILER + "".join(f" --hash=sha256:{digest}" for digest in COMPILERS) + "\n")
        pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--require-hashes"]
        subprocess.run([*pip, "--target", str(packages), "-r", str(listed)], check=True)
    return packages


def _compiled(wheel: Path, packages: Path) -> bytes:
    """Compile and link; raises RuntimeError where the names are not those of the published library."""
    with tempfile.TemporaryDirectory() as scratch, zipfile.ZipFile(wheel) as package:
        root = Path(scratch)
        for name in package.namelist():
            if name.startswith(_NATIVE):
                package.extract(name, root)
        sources = root / _NATIVE
        wanted = elf.exported(package.read(FILE))
        (root / "refusals.cpp").write_text(refusals({n for n in wanted if n.startswith(_REFUSED)}))
        (root / "exports.ld").write_text(_EXPORTS)
        files = sorted(p.name for p in sources.glob("*.cpp") if p.name not in _VOLUMES)
        link = ["-shared", "-s", "-Wl,-z,lazy", "-Wl,--version-script=../../exports.ld", "-lpthread", "-ldl"]
        compiler = [sys.executable, "-m", "ziglang", "c++", "-target", TARGET]
        subprocess.run(
            [
                *compiler,
                *SWITCHES,
                *link,
                "-o",
                "../../warp.so",
                *files,
                "../../refusals.cpp",
                "-lpthread",
                "-ldl",
            ],
            check=True,
            cwd=sources,
            env={
                **os.environ,
                "PYTHONPATH": str(packages),
                "ZIG_GLOBAL_CACHE_DIR": str(root / "cache"),
                "ZIG_LOCAL_CACHE_DIR": str(root / "cache"),
            },
        )
        content = (root / "warp.so").read_bytes()
    if elf.exported(content) != wanted:
        differ = ", ".join(sorted(elf.exported(content) ^ wanted)[:5])
        raise RuntimeError(f"the library without CUDA differs from the published one in {differ}, ...")
    return content
