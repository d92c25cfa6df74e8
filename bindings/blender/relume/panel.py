# SPDX-License-Identifier: MIT
"""What the user sets, of the scene and of Blender, and the panel in the scene's properties."""
import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

PRESETS = [("draft", "Draft", "A second or two, while modelling"), ("medium", "Medium", "Daily builds"),
           ("web", "Web", "As medium, for pages that download the bake"), ("high", "High", "The game"),
           ("best", "Best", "To compare with")]


class Preferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    program: StringProperty(name="Program", description="The command relume; empty: the one of PATH", subtype="FILE_PATH")

    def draw(self, context):
        self.layout.prop(self, "program")


class Settings(bpy.types.PropertyGroup):
    preset: EnumProperty(name="Preset", description="Where the bake's options start from", items=PRESETS, default="high")
    bake: StringProperty(name="Bake", description="File to write; empty: beside the .blend file, by its name", subtype="FILE_PATH")
    options: StringProperty(name="Options", description="JSON file with options of relume bake, over the preset", subtype="FILE_PATH")
    texcoords: BoolProperty(name="Light-map UV", description="Put the light map's coordinates on the objects, as UV map \"Relume\"; faces in "
                            "which a chart ends are cut into triangles, and linked copies get meshes of their own", default=True)
    width: IntProperty(name="Width", description="Of the preview", subtype="PIXEL", default=640, min=16, max=16384)
    height: IntProperty(name="Height", description="Of the preview", subtype="PIXEL", default=360, min=16, max=16384)
    exposure: FloatProperty(name="Exposure", description="Stops by which the preview's light is brightened", default=0.0, min=-30.0, max=30.0)


class ScenePanel(bpy.types.Panel):
    bl_idname = "SCENE_PT_relume"
    bl_label = "Relume"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "scene"

    def draw(self, context):
        settings, layout = context.scene.relume_settings, self.layout
        layout.use_property_split = True
        for name in ("preset", "options", "bake", "texcoords"):
            layout.prop(settings, name)
        layout.operator("relume.bake", icon="LIGHT_SUN")
        column = layout.column(align=True)
        for name in ("width", "height", "exposure"):
            column.prop(settings, name)
        layout.operator("relume.preview", icon="IMAGE_DATA")
        layout.operator("relume.export", icon="EXPORT")
