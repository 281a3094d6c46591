"""The sketch, compiled on this machine against a stub of the board: the decoder understands its bytes."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from mu_addon.sensing.decoder import Decoder
from mu_addon.sensing.samples import Samples

ROOT = Path(__file__).parents[2]
COMPILER = next((found for name in ("c++", "g++", "clang++") if (found := shutil.which(name))), None)

pytestmark = pytest.mark.skipif(COMPILER is None, reason="NOT TESTED: no C++ compiler is installed")


@pytest.fixture(scope="module")
def sketch(tmp_path_factory: pytest.TempPathFactory) -> Path:
    program = tmp_path_factory.mktemp("firmware") / "sketch"
    here = Path(__file__).parent / "arduino"
    command = [str(COMPILER), "-std=c++11", "-Wall", "-Wextra", "-Werror", "-x", "c++"]
    folders = [f"-I{here}", f"-I{ROOT / 'assets/firmware/mu_sensor'}"]
    subprocess.run([*command, *folders, str(here / "host.cpp"), "-o", str(program)], check=True)
    return program


def decoded(data: bytes) -> tuple[Decoder, list[Samples]]:
    decoder = Decoder()
    groups = []
    for k in range(0, len(data), 1000):
        groups += decoder.feed(data[k : k + 1000], k / 1000 * 0.06)
    return decoder, groups


def test_its_bytes_are_understood(sketch: Path) -> None:
    data = subprocess.run([sketch, "3"], capture_output=True, check=True).stdout
    decoder, groups = decoded(data)
    assert decoder.format == "frames"
    assert decoder.counters.crc_errors == decoder.counters.malformed == decoder.counters.lost == 0
    (channels,) = {g.layout.channels for g in groups}
    assert channels == ("light1", "dark1", "light2", "dark2")
    values = np.vstack([g.values for g in groups]) / groups[0].layout.per_count
    np.testing.assert_allclose(values, np.tile([714, 34, 715, 35], (len(values), 1)))
    time_s = np.concatenate([g.device_s for g in groups])
    # 400 a second, through a wrap of the board's clock.
    np.testing.assert_allclose(np.diff(time_s), 2.5e-3, atol=2e-5)
    assert len(time_s) == pytest.approx(1200, abs=2)


def test_a_full_buffer_shows_as_a_gap(sketch: Path) -> None:
    decoder, groups = decoded(subprocess.run([sketch, "1", "100"], capture_output=True, check=True).stdout)
    assert decoder.counters.lost == 10
    assert decoder.counters.crc_errors == 0
    assert {100, 109}.isdisjoint(np.concatenate([g.sequence for g in groups]).tolist())
