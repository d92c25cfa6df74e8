# SPDX-License-Identifier: MIT
"""Relume in Blender: bakes the open scene by the program `relume`, puts the light map's coordinates on its objects, shows its light, and
writes level and bake for a game. docs/guide/blender.md says how it is used."""
import bpy

from . import operators, panel

bl_info = {
    "name": "Relume",
    "author": "The Relume authors",
    "version": (0, 2, 0),
    "blender": (3, 4, 0),
    "location": "Properties > Scene > Relume",
    "description": "Bake how light travels through the open scene, for games",
    "category": "Render",
}

CLASSES = (panel.Preferences, panel.Settings, *operators.CLASSES, panel.ScenePanel)


def register():
    for each in CLASSES:
        bpy.utils.register_class(each)
    bpy.types.Scene.relume_settings = bpy.props.PointerProperty(type=panel.Settings)


def unregister():
    del bpy.types.Scene.relume_settings
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)
