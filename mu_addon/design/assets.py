"""Files shipped with the code: presets, protocols, materials."""

from __future__ import annotations

from pathlib import Path

from ..errors import InputError
from .toml_text import nearest


def asset_root() -> Path:
    """Folder `assets`: inside the package in the built extension, beside it in a checkout; or InputError."""
    package = Path(__file__).resolve().parent.parent
    for folder in (package / "assets", package.parent / "assets"):
        if folder.is_dir():
            return folder
    raise InputError(
        "the folder of presets and protocols is missing",
        f"{package / 'assets'} or {package.parent / 'assets'}",
        "install the whole extension or work in a complete checkout",
    )


def asset_names(folder: str) -> list[str]:
    """Names of the TOML files shipped in a folder of `assets`, sorted."""
    return sorted(path.stem for path in (asset_root() / folder).glob("*.toml"))


def asset_file(folder: str, what: str, name: str) -> Path:
    """The shipped TOML file of that name; InputError lists the names there are, `what` says of what."""
    names = asset_names(folder)
    if name not in names:
        raise InputError(
            f"there is no {what} {name!r}{nearest(name, names)}",
            what,
            f"choose one of {', '.join(names)}, or give the path of a TOML file",
        )
    return asset_root() / folder / f"{name}.toml"
