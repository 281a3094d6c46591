"""Entries that come back whole, or not at all."""

import numpy as np

from mu_addon.files import write_npz
from mu_addon.run.cache import Cache, key


def test_an_entry_comes_back(tmp_path):
    cache = Cache(tmp_path)
    cache.put("mesh", "a", {"x": np.arange(5.0), "n": 3})
    found = cache.get("mesh", "a")
    assert found is not None
    np.testing.assert_array_equal(found["x"], np.arange(5.0))
    assert cache.get("mesh", "b") is None


def test_another_entry_under_this_name_is_missing(tmp_path):
    cache = Cache(tmp_path)
    cache.put("mesh", "a", {"x": np.arange(5.0)})
    cache.path("mesh", "a").replace(cache.path("mesh", "b"))
    assert cache.get("mesh", "b") is None
    write_npz(cache.path("mesh", "a"), {"x": np.arange(5.0)})
    assert not cache.has("mesh", "a")
    cache.put("mesh", "a", {"x": np.arange(5.0)})
    assert cache.has("mesh", "a")


def test_keys_tell_inputs_apart():
    same = [key(1.0, "a", np.arange(3)) for _ in range(2)]
    assert same[0] == same[1]
    assert (
        len({same[0], key(1.0, "a", np.arange(4)), key(1.0, "b", np.arange(3)), key(1, "a", np.arange(3))})
        == 4
    )
    assert key("ab", "c") != key("a", "bc")
    assert key(np.zeros((2, 3))) != key(np.zeros((3, 2)))
