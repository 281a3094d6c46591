"""The extension comes and goes without residue, and shows every parameter that the core has."""

from .session import blender, needs_bpy

pytestmark = needs_bpy


def test_register_and_unregister_twice_leave_nothing(tmp_path):
    blender(
        """
        import sys
        import bpy
        import mu_addon

        def ours():
            classes = {name for name in dir(bpy.types) if name.startswith("MU_")}
            lists = ("undo_post", "redo_post", "load_post")
            handlers = sum(len(getattr(bpy.app.handlers, name)) for name in lists)
            menu = len(getattr(bpy.types.VIEW3D_MT_mesh_add.draw, "_draw_funcs", ()))
            return classes, handlers, menu, hasattr(bpy.types.Object, "mu_unit")

        assert "bpy" in sys.modules and "mu_addon.blender" not in sys.modules
        before = ours()
        mu_addon.register()
        mu_addon.register()
        once = ours()
        assert len(once[0]) > 20 and once[1] > before[1] and once[3]
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
        """,
        tmp_path,
        prelude="",
    )


def test_a_failure_while_registering_leaves_nothing(tmp_path):
    blender(
        """
        import bpy
        import mu_addon
        from mu_addon.blender.unit import panel as panels

        def fails():
            raise RuntimeError("no")

        kept, panels.register = panels.register, fails
        unregister, panels.unregister = panels.unregister, lambda: None
        try:
            mu_addon.register()
        except RuntimeError:
            pass
        else:
            raise AssertionError
        assert not [name for name in dir(bpy.types) if name.startswith("MU_")]
        panels.register, panels.unregister = kept, unregister
        mu_addon.register()
        assert hasattr(bpy.types, "MU_PT_unit")
        """,
        tmp_path,
        prelude="",
    )


def test_every_parameter_of_the_core_is_a_property(tmp_path):
    blender(
        """
        from mu_addon.blender.unit.properties import GROUPS, UNITS
        from mu_addon.design.parameters import SECTIONS
        from mu_addon.design.quantity import describe

        for section in SECTIONS:
            shown = GROUPS[section.section].bl_rna.properties
            for d in describe(section):
                p = shown[d.name]
                assert d.text[1:] in p.description and f"Source: {d.source}" in p.description
                assert not p.description.endswith(".") or d.source.endswith(".")
                if d.choices:
                    assert [i.identifier for i in p.enum_items] == list(d.choices) and p.default == d.default
                elif d.type is bool:
                    assert p.type == "BOOLEAN"
                else:
                    assert abs(p.hard_min - d.low) < 1e-6 and abs(p.hard_max - d.high) < 1e-3
                    assert abs(p.default - d.default) < 1e-4
                    assert (p.subtype == "DISTANCE") == (d.unit == "mm")
                    assert f"{d.low:g} to {d.high:g} {d.unit}".rstrip() in p.description
                    if d.unit and d.unit != "mm":
                        assert p.name.endswith(f"({d.unit})")
        """,
        tmp_path,
    )


def test_a_new_section_of_the_core_appears_by_itself(tmp_path):
    blender(
        """
        import attrs
        import bpy
        import mu_addon
        from typing import ClassVar
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
        from mu_addon.blender.shared.panels import parameters as draw
        from mu_addon.blender.unit.properties import section_of
        assert section_of(root.mu_unit, "novelty") == {"depth_mm": 1.25, "way": "right"}

        class Layout:
            shown = []
            def column(self, align=False):
                return self
            def prop(self, group, name):
                self.shown.append(name)

        draw(Layout(), root.mu_unit, "design")
        assert Layout.shown[-2:] == ["depth_mm", "way"]
        """,
        tmp_path,
        prelude="",
    )


def test_values_survive_single_precision(tmp_path):
    blender(
        """
        from mu_addon.blender.shared import updates
        from mu_addon.blender.unit.properties import exact, from_unit, to_unit
        from mu_addon.design.parameters import preset_names

        assert exact(0.8999999761581421) == 0.9 and exact(3.125) == 3.125 and exact(1e6) == 1e6
        root = add()
        for name in preset_names():
            with updates.paused():
                from_unit(root.mu_unit, load_preset(name))
            assert to_unit(root.mu_unit) == load_preset(name)
            assert to_unit(root.mu_unit).hash() == load_preset(name).hash()
        """,
        tmp_path,
    )


def test_everything_a_designer_meets_says_what_it_is(tmp_path):
    blender(
        """
        ours = [getattr(bpy.types, name) for name in dir(bpy.types) if name.startswith("MU_")]
        silent = [cls.__name__ for cls in ours if not (cls.__doc__ or "").strip()]
        groups = [cls for cls in bpy.types.PropertyGroup.__subclasses__() if cls.__name__.startswith("MU_")]
        CLASSES = operators()

        shown = [(cls.__name__, cls.bl_rna) for cls in groups]
        shown += [(c.bl_idname, getattr(bpy.ops.mu, c.bl_idname[3:]).get_rna_type()) for c in CLASSES]
        for name, kind in shown:
            if name in {c.bl_idname for c in CLASSES} and not kind.description:
                silent.append(name)
            for p in kind.properties:
                if p.identifier not in ("rna_type", "name") and not p.is_hidden and not p.description:
                    silent.append(f"{name}.{p.identifier}")
        assert len(shown) > 40 and not silent, silent
        """,
        tmp_path,
    )
