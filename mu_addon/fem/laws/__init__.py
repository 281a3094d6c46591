"""Material laws: each gives energy, first Piola-Kirchhoff stress and tangent by F, and its valid range.

`LAWS` holds every law of this folder by its name in files; each class can be imported from here.
"""

from importlib import import_module
from pkgutil import iter_modules
from typing import Any

from .law import Law as Law

for _module in iter_modules(__path__):
    import_module(f".{_module.name}", __name__)

LAWS: dict[str, Any] = {law.name.lower(): law for law in sorted(Law.__subclasses__(), key=lambda c: c.name)}
_CLASSES = {law.__name__: law for law in LAWS.values()}


def __getattr__(name: str) -> Any:
    if name not in _CLASSES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return _CLASSES[name]
