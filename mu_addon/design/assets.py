"""Files shipped with the code: presets, protocols, materials."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from ..errors import InputError, did_you_mean
from ..reading import file_text, parse_toml


def asset_root() -> Path:
    """The folder `assets`: inside the package in the built extension, next to it in a checkout.

    Raises InputError where neither exists.
    """
    package = Path(__file__).resolve().parent.parent
    for folder in (package / "assets", package.parent / "assets"):
        if folder.is_dir():
            return folder
    raise InputError(
        "the folder of presets and protocols is missing",
        f"{package / 'assets'} or {package.parent / 'assets'}",
        "install the complete extension or work in a complete checkout",
    )


def asset_names(folder: str, kind: str = "") -> list[str]:
    """Sorted names (file stems) of the TOML files in a folder of `assets` whose key `kind` has this value.

    kind: "" for the files that have no such key, as most do. Raises InputError where `assets` is missing or a
    file is not TOML.
    """
    paths = (asset_root() / folder).glob("*.toml")
    return sorted(path.stem for path in paths if _kind(path) == kind)


def asset_file(folder: str, what: str, name: str, kind: str = "") -> Path:
    """Path of the shipped TOML file `name` of this `kind` in a folder of `assets`.

    what: the noun for messages, such as "preset". Raises InputError, with the valid names, for an unknown
    name or a file of another kind.
    """
    names = asset_names(folder, kind)
    files = {path.stem: path for path in (asset_root() / folder).glob("*.toml")}
    if name in names:
        return files[name]
    if name in files:
        what_it_is = (
            f"{name!r} is a {_kind(files[name])}" if _kind(files[name]) else f"{name!r} is not a {what}"
        )
        raise InputError(what_it_is, what, f"choose one of {', '.join(names)}")
    raise InputError(
        f"there is no {what} {name!r}{did_you_mean(name, names)}",
        what,
        f"choose one of {', '.join(names)}, or give the path of a TOML file",
    )


def _kind(path: Path) -> str:
    """The value of `kind = ...` in a TOML file, empty without one; read again only when it changes."""
    return _kind_of(path, path.stat().st_mtime_ns)


@lru_cache(maxsize=256)
def _kind_of(path: Path, changed_ns: int) -> str:
    return str(parse_toml(file_text(path), str(path)).get("kind", ""))
