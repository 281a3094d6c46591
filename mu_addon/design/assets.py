"""Files shipped with the code: presets, protocols, materials."""

from __future__ import annotations

from pathlib import Path

from ..errors import InputError


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
