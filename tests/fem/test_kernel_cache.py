"""Warp's cache of kernels: cut short, emptied, on a disk that is read-only or full."""

import os
import random
import shutil
import subprocess
import sys

import pytest

from mu_addon.fem import kernel_cache
from mu_addon.fem.kernel_cache import entries, is_whole, seal, usable_cache

# Compiles a kernel of its own, or takes it from the cache.
COMPILE = """
import numpy as np, warp as wp
from mu_addon.fem import kernels

@wp.kernel
def doubled(x: wp.array(dtype=float)):
    x[wp.tid()] = 2.0 * x[wp.tid()]

x = wp.array(np.arange(3.0), dtype=float, device="cpu")
wp.launch(doubled, 3, inputs=[x], device="cpu")
print(wp.config.kernel_cache_dir, x.numpy().tolist())
"""


def compiled(tmp_path, cache):
    script = tmp_path / "compile.py"
    script.write_text(COMPILE)
    done = subprocess.run(
        [sys.executable, script],
        env=os.environ | {"WARP_CACHE_PATH": str(cache)},
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert done.returncode == 0, done.stderr
    folder, _, numbers = done.stdout.strip().partition(" ")
    assert numbers == "[0.0, 2.0, 4.0]"
    return folder


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A cache with an entry of Warp's own."""
    work = tmp_path_factory.mktemp("kernels")
    folder = compiled(work, work / "cache")
    assert folder.startswith(str(work / "cache"))
    return work / "cache"


def damage(cache, suffix, change):
    (found,) = cache.rglob(f"*{suffix}")
    found.write_bytes(change(found.read_bytes()))


@pytest.mark.parametrize("suffix", [".meta", ".o"])
@pytest.mark.parametrize(
    "change",
    [lambda b: b[: len(b) // 2], lambda b: b[:-1], lambda b: b"", lambda b: bytes(len(b))],
    ids=["half", "one byte less", "empty", "zeros"],
)
@pytest.mark.skipif(sys.platform != "linux", reason="object files of ELF")
def test_a_damaged_entry_is_made_anew(made, tmp_path, suffix, change):
    cache = shutil.copytree(made, tmp_path / "cache")
    (entry,) = entries(next(cache.iterdir()))
    assert is_whole(entry)
    damage(cache, suffix, change)
    assert not is_whole(entry)
    assert usable_cache(entry.parent) == entry.parent
    assert not entry.exists()


@pytest.mark.parametrize("suffix", [".meta", ".o", ".cpp", "sha256.json"])
@pytest.mark.parametrize("seed", range(10))
def test_one_flipped_bit_is_found(made, tmp_path, suffix, seed):
    """In object code as well, of which Warp has no doubt."""
    cache = shutil.copytree(made, tmp_path / "cache")
    (entry,) = entries(next(cache.iterdir()))

    def flipped(content):
        bit = random.Random(seed).randrange(8 * len(content))
        changed = bytearray(content)
        changed[bit // 8] ^= 1 << bit % 8
        return bytes(changed)

    damage(cache, suffix, flipped)
    assert not is_whole(entry)
    assert usable_cache(entry.parent) == entry.parent
    assert not entry.exists()


def test_object_code_with_flipped_bits_is_not_run(made, tmp_path):
    cache = shutil.copytree(made, tmp_path / "cache")
    damage(cache, ".o", lambda b: b[:64] + bytes(~x & 255 for x in b[64:512]) + b[512:])
    compiled(tmp_path, cache)
    (entry,) = entries(next(cache.iterdir()))
    assert is_whole(entry)


def test_an_entry_is_sealed_once(made, tmp_path):
    """What was added since gets its digest; what changed since does not get another."""
    cache = shutil.copytree(made, tmp_path / "cache")
    (entry,) = entries(next(cache.iterdir()))
    before = (entry / "sha256.json").read_bytes()
    seal(entry.parent)
    assert (entry / "sha256.json").read_bytes() == before
    (entry / "other.o").write_bytes(next(entry.glob("*.o")).read_bytes())
    seal(entry.parent)
    assert is_whole(entry)
    damage(cache, "other.o", lambda b: b[:200] + bytes([b[200] ^ 1]) + b[201:])
    seal(entry.parent)
    assert not is_whole(entry)


def test_entries_made_before_there_were_seals_are_sealed(made, tmp_path):
    cache = shutil.copytree(made, tmp_path / "cache")
    (entry,) = entries(next(cache.iterdir()))
    (entry / "sha256.json").unlink()
    assert is_whole(entry)
    assert usable_cache(entry.parent) == entry.parent
    assert (entry / "sha256.json").exists()


def test_what_another_process_builds_is_left_alone(tmp_path):
    building = tmp_path / "wp_kernel_0_p12_t34"
    building.mkdir()
    (building / "wp_kernel_0.meta").write_bytes(b"")
    assert usable_cache(tmp_path) == tmp_path
    assert building.exists()


def test_where_it_cannot_be_written_a_copy_serves(made, monkeypatch):
    """As on a disk that is read-only, or full."""
    monkeypatch.setattr(kernel_cache, "NEEDED_BYTES", 1 << 62)
    (cache,) = made.iterdir()
    copy = usable_cache(cache)
    assert copy != cache
    assert [e.name for e in entries(copy)] == [e.name for e in entries(cache)]


def test_where_its_folder_cannot_be_made(tmp_path):
    (tmp_path / "file").write_text("")
    folder = compiled(tmp_path, tmp_path / "file" / "cache")
    assert "mu-kernels-" in folder
    assert not os.path.exists(folder)
