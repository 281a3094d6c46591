"""What a .blend file keeps of the extension: each property by its name, type and the numbers of its choices.

`python -m tests.blender.inside.property_ids` writes the list anew; a file of before must still find its own.
"""

from pathlib import Path

import bpy

import mu_addon

KEPT = Path(__file__).parents[1] / "property_ids.txt"


def listed():
    """A line for each class of properties."""
    kinds = bpy.types.PropertyGroup, bpy.types.Node, bpy.types.NodeTree
    every = {cls for kind in kinds for cls in kind.__subclasses__() if cls.__name__.startswith(("MU_", "Mu"))}
    return sorted(f"{cls.__name__}: {' '.join(kept(cls.bl_rna))}" for cls in every)


def kept(rna):
    """The properties of a class itself that a file keeps."""
    for p in sorted(rna.properties, key=lambda p: p.identifier):
        if p.identifier not in rna.base.properties and not p.is_skip_save:
            choices = [f"{item.identifier}={item.value}" for item in getattr(p, "enum_items", ())]
            length = getattr(p, "array_length", 0) or ""
            yield f"{p.identifier}:{p.type.lower()}{length}{'(' + ','.join(choices) + ')' if choices else ''}"


if __name__ == "__main__":
    mu_addon.register()
    KEPT.write_text("\n".join(listed()) + "\n", encoding="utf-8")
