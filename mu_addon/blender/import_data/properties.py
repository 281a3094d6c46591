"""Files being imported into a unit's measured data, and their open questions."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import bpy
from bpy.props import BoolProperty, CollectionProperty, StringProperty

from ..shared.registration import property_group_factory


def _offered(self, context, typed):
    """Answers that a question offers."""
    return [choice for choice in self.choices.split("\n") if typed.casefold() in choice.casefold()]


class MU_PG_import_answer(bpy.types.PropertyGroup):
    """An open question of an import, and its answer."""

    key: StringProperty(options={"HIDDEN"})
    words: StringProperty(options={"HIDDEN"})
    choices: StringProperty(options={"HIDDEN"})
    experiment: StringProperty(options={"HIDDEN"})
    answered: BoolProperty(options={"HIDDEN"})
    value: StringProperty(
        name="Answer",
        description="Open questions of the file",
        search=_offered,
        search_options={"SORT", "SUGGESTION"},
    )


class MU_PG_import(bpy.types.PropertyGroup):
    """Files being imported into a folder of measured data."""

    files: StringProperty(options={"HIDDEN"})
    answers: CollectionProperty(type=MU_PG_import_answer, options={"HIDDEN"})


register, unregister = property_group_factory(
    bpy.types.Object, "mu_import", (MU_PG_import_answer, MU_PG_import)
)
