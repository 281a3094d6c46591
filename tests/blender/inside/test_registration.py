"""The extension comes and goes without residue, and shows every parameter that the core has.

Imports stand in the tests: two of them need a process in which none has happened.
"""

from typing import ClassVar

import bpy
import pytest

COMPILED = ("cvxopt", "gmsh", "ipctk", "manifold3d", "matplotlib", "PIL", "pymetis", "python_calamine")
COMPILED += ("pytetwild", "scipy", "warp")
"""What an archive for another system or Python cannot load."""


@pytest.mark.own_process
def test_register_and_unregister_twice_leave_nothing(monkeypatch):
    """Also where no compiled package loads."""
    import sys

    import mu_addon

    def ours():
        classes = {name for name in dir(bpy.types) if name.startswith("MU_")}
        lists = ("undo_post", "redo_post", "load_post")
        handlers = sum(len(getattr(bpy.app.handlers, name)) for name in lists)
        menu = len(getattr(bpy.types.VIEW3D_MT_mesh_add.draw, "_draw_funcs", ()))
        return classes, handlers, menu, hasattr(bpy.types.Object, "mu_unit")

    assert "bpy" in sys.modules
    assert "mu_addon.blender" not in sys.modules
    before = ours()
    for name in COMPILED:
        monkeypatch.setitem(sys.modules, name, None)
    mu_addon.register()
    mu_addon.register()
    once = ours()
    assert len(once[0]) > 20
    assert once[1] > before[1]
    assert once[3]
    mu_addon.unregister()
    mu_addon.unregister()
    after = ours()
    assert after[0] == before[0] == set()
    assert after[1] == before[1]
    assert after[2] == once[2] - 1
    assert not after[3]
    mu_addon.register()
    assert ours() == once
    mu_addon.unregister()


@pytest.mark.own_process
def test_a_failure_while_registering_leaves_nothing(monkeypatch):
    import mu_addon
    from mu_addon.blender.shared import registration
    from mu_addon.blender.sidebar import unit_panel

    def fails():
        raise RuntimeError("no")

    with monkeypatch.context() as patch:
        patch.setitem(
            registration._declared[unit_panel.__name__], "fails", registration.Hook(9, fails, fails)
        )
        with pytest.raises(RuntimeError, match="no"):
            mu_addon.register()
        assert not [name for name in dir(bpy.types) if name.startswith("MU_")]
    mu_addon.register()
    assert hasattr(bpy.types, "MU_PT_unit")


def test_every_parameter_of_the_core_is_a_property():
    from mu_addon.blender.unit.properties import GROUPS
    from mu_addon.design.parameters import SECTIONS
    from mu_addon.design.quantity import describe

    for section in SECTIONS:
        shown = GROUPS[section.section].bl_rna.properties
        for d in describe(section):
            p = shown[d.name]
            assert d.text[1:] in p.description
            assert f"Source: {d.source}" in p.description
            assert not p.description.endswith(".") or d.source.endswith(".")
            if d.choices:
                assert [i.identifier for i in p.enum_items] == list(d.choices)
                assert p.default == d.default
            elif d.type is bool:
                assert p.type == "BOOLEAN"
            elif d.type is str:
                assert (p.type, p.default) == ("STRING", d.default)
            else:
                assert abs(p.hard_min - d.low) < 1e-6
                assert abs(p.hard_max - d.high) < 1e-3
                assert abs(p.default - d.default) < 1e-4
                assert (p.subtype == "DISTANCE_CAMERA") == (d.unit == "mm")
                assert f"{d.allowed} {d.unit}".rstrip() in p.description
                if d.unit and d.unit != "mm":
                    assert p.name.endswith(f"({d.unit})")


@pytest.mark.own_process
def test_a_new_section_of_the_core_appears_by_itself():
    import attrs

    import mu_addon
    from mu_addon.design import parameters
    from mu_addon.design.quantity import choice, quantity

    @attrs.frozen
    class Novelty:
        section: ClassVar[str] = "novelty"
        depth_mm: float = quantity(0.7, "mm", 0.1, 2.0, "depth of the novelty", "assumed: a test")
        way: str = choice("left", lambda: ("left", "right"), "way it turns", "paper")

    parameters.SECTIONS += (Novelty,)
    parameters.Unit.__annotations__["novelty"] = Novelty
    mu_addon.register()
    root = bpy.data.objects.new("x", None)
    group = root.mu_unit.novelty
    group.depth_mm, group.way = 1.25, "right"
    from mu_addon.blender.unit.base_classes import parameters as draw
    from mu_addon.blender.unit.properties import section_of

    assert section_of(root.mu_unit, "novelty") == {"depth_mm": 1.25, "way": "right"}

    class Layout:
        shown: ClassVar[list[str]] = []

        def column(self, align=False):
            return self

        def panel(self, name, default_closed=False):
            # The fold is closed.
            return self, None

        def label(self, text, icon):
            pass

        def prop(self, group, name):
            self.shown.append(name)

    draw(Layout(), root, "design")
    assert Layout.shown[-2:] == ["depth_mm", "way"]


@pytest.mark.own_process
def test_a_button_is_one_file(tmp_path):
    """The one of the page on extending, which is put beside the rooms' own files."""
    import re
    from pathlib import Path

    import mu_addon
    from mu_addon.blender import unit

    page = Path(mu_addon.__file__).parents[1] / "docs" / "engineering" / "extend.md"
    text = page.read_text(encoding="utf-8").split("## Add a panel button")[1]
    (tmp_path / "thicken.py").write_text(re.search(r"```\n(.*?)```", text, re.DOTALL)[1], encoding="utf-8")
    unit.__path__.append(str(tmp_path))
    mu_addon.register()
    from .acting import add
    from .drawing import drawn

    root = add()
    places = [bpy.types.MU_PT_design, bpy.types.MU_MT_design_step]
    assert drawn(places).count("mu.thicken") == 2
    assert bpy.ops.mu.thicken() == {"FINISHED"}
    assert abs(root.mu_unit.chambers.wall_mm - 1.0) < 1e-6
    mu_addon.unregister()
    assert not hasattr(bpy.types, "MU_OT_thicken")


def test_a_file_of_before_finds_every_property_that_it_has():
    from .property_ids import KEPT, listed

    assert listed() == KEPT.read_text(encoding="utf-8").splitlines()


def test_values_survive_single_precision():
    from mu_addon.blender.shared import updates
    from mu_addon.blender.shared.blender_property import exact
    from mu_addon.blender.unit.properties import from_unit, to_unit
    from mu_addon.design.parameters import load_preset, preset_names

    from .acting import add

    assert exact(0.8999999761581421) == 0.9
    assert exact(3.125) == 3.125
    assert exact(1e6) == 1e6
    root = add()
    for name in preset_names():
        with updates.paused():
            from_unit(root.mu_unit, load_preset(name))
        assert to_unit(root.mu_unit) == load_preset(name)
        assert to_unit(root.mu_unit).hash() == load_preset(name).hash()


def test_everything_a_designer_meets_says_what_it_is():
    ours = [getattr(bpy.types, name) for name in dir(bpy.types) if name.startswith("MU_")]
    silent = [cls.__name__ for cls in ours if not (cls.__doc__ or "").strip()]
    from .acting import operators

    groups = [cls for cls in bpy.types.PropertyGroup.__subclasses__() if cls.__name__.startswith("MU_")]
    shown = [(cls.__name__, cls.bl_rna) for cls in groups]
    shown += [(c.bl_idname, getattr(bpy.ops.mu, c.bl_idname[3:]).get_rna_type()) for c in operators()]
    for name, kind in shown:
        if name in {c.bl_idname for c in operators()} and not kind.description:
            silent.append(name)
        for p in kind.properties:
            if p.identifier not in ("rna_type", "name") and not p.is_hidden and not p.description:
                silent.append(f"{name}.{p.identifier}")
    assert len(shown) > 40
    assert not silent, silent


def test_no_setting_is_an_error_to_set(tmp_path):
    """Blender prints what fails in a property's update function: here each property is set to its value."""
    import os

    from .acting import add

    root = add(preset="mu-1.0x")
    for kind in ("targets", "freedoms"):
        bpy.ops.mu.optimize_list(what=kind)
    bpy.ops.mu.gripper_add()
    gripper = bpy.context.view_layer.objects.active
    groups = [getattr(root, name) for name in dir(root) if name.startswith("mu_") and name != "mu_gripper"]
    assert len(groups) > 8
    kept = os.dup(1), os.dup(2)
    with (tmp_path / "output").open("w") as file:
        for number in (1, 2):
            os.dup2(file.fileno(), number)
        try:
            done = sum(map(_set_again, [*groups, gripper.mu_gripper]))
        finally:
            for number, own in zip((1, 2), kept, strict=True):
                os.dup2(own, number)
                os.close(own)
    output = (tmp_path / "output").read_text()
    assert done > 150, done
    assert "Error" not in output, output


def _set_again(group):
    """Set every setting in a group, and in the groups within, to its value; return their number."""
    done = 0
    for prop in group.bl_rna.properties:
        if prop.identifier == "rna_type":
            continue
        value = getattr(group, prop.identifier)
        if prop.type == "COLLECTION":
            done += sum(_set_again(row) for row in value)
        elif prop.type == "POINTER":
            inner = isinstance(value, bpy.types.PropertyGroup)
            done += _set_again(value) if inner else 0
        elif not prop.is_readonly and not (prop.type == "ENUM" and value == ""):
            # A list without items holds no value.
            setattr(group, prop.identifier, value)
            done += 1
    return done
