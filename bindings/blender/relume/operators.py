# SPDX-License-Identifier: MIT
"""Bake, preview, export. Each writes the open scene as a level into a folder of this session and runs `relume` on it: from the window with
its progress in the status bar, where Esc cancels; from a script, or without a window, to its end."""
import os
import shutil
import tempfile

import bpy
from bpy_extras.io_utils import ExportHelper

from . import level, program, texcoords, world

PREVIEW = "Relume preview"  # image
_BAKE_MAGIC = b"\x89RLM\r\n\x1a\n"  # a bake's first bytes
_folder = None
_BUSY = "relume is running; wait for it, or press Esc to cancel it"
_running = None  # the operator whose run a window follows: all use the same files of the session folder


def session_folder():
    """Blender removes its own temporary folder when it ends."""
    global _folder
    if _folder is None or not os.path.isdir(_folder):
        _folder = tempfile.mkdtemp(prefix="relume_", dir=bpy.app.tempdir or None)
    return _folder


def bake_path(scene):
    """Of the bake to write and to show: as the settings say, beside the .blend file, or of this session while that has no name."""
    if scene.relume_settings.bake:
        return bpy.path.abspath(scene.relume_settings.bake)
    if bpy.data.filepath:
        return os.path.splitext(bpy.data.filepath)[0] + ".relume"
    return os.path.join(session_folder(), "scene.relume")


def is_bake(path):
    with open(path, "rb") as file:
        return file.read(len(_BAKE_MAGIC)) == _BAKE_MAGIC


def write_level(scene, warn):
    """Gives its path. warn: is called with what it says of things that the level cannot have."""
    path = os.path.join(session_folder(), "level.glb")
    for why, names in level.export(scene, path).items():
        warn(f"not in the level: {texcoords.listed(names)}: {why}")
    return path


class Command:
    """What the operators share. A subclass says what to run, and what to do once it has."""

    _run = _timer = None

    @classmethod
    def poll(cls, context):
        cls.poll_message_set(_BUSY if _running else "of a scene in object mode")
        return _running is None and context.mode == "OBJECT"

    def words(self, context):
        raise NotImplementedError

    def warn(self, text):
        self.report({"WARNING"}, text)

    def done(self, context, run):
        """True where it is to run once more."""
        raise NotImplementedError

    def start(self, context):
        if _running not in (None, self):  # a file dialog that was open before asks no poll()
            raise program.RelumeError(_BUSY)
        found = program.find(bpy.path.abspath(context.preferences.addons[__package__].preferences.program))
        return program.Run(found, *self.words(context))

    def finish(self, context, run):
        if run.cancelled:
            self.report({"WARNING"}, "cancelled; this run of relume wrote nothing")
            return {"CANCELLED"}
        for text in run.warnings:
            self.report({"WARNING"}, text)
        return {"RUNNING_MODAL"} if self.done(context, run.check()) else {"FINISHED"}

    def attempt(self, work):
        """Errors that a user can mend become the operator's report."""
        try:
            return work()
        except (program.RelumeError, OSError, ValueError, RuntimeError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}

    def execute(self, context):
        ended = {"RUNNING_MODAL"}
        while ended == {"RUNNING_MODAL"}:
            ended = self.attempt(lambda: self.finish(context, self.start(context).wait()))
        return ended

    def invoke(self, context, event):
        def begin():
            global _running
            self._run = self.start(context)
            self._timer = context.window_manager.event_timer_add(0.1, window=context.window)
            context.window_manager.progress_begin(0, 100)
            context.window_manager.modal_handler_add(self)
            _running = self
            return {"RUNNING_MODAL"}
        return self.attempt(begin)

    def modal(self, context, event):
        ended = None
        try:
            ended = self.attempt(lambda: self.follow(context, event))
        finally:  # what attempt() does not know of comes through
            if ended not in ({"RUNNING_MODAL"}, {"PASS_THROUGH"}):
                self.leave(context)
        return ended

    def follow(self, context, event):
        if event.type == "ESC":
            self._run.cancel()
        elif event.type != "TIMER":
            return {"PASS_THROUGH"}
        elif self._run.ended():
            ended = self.finish(context, self._run)
            if ended != {"RUNNING_MODAL"}:
                return ended
            self._run = self.start(context)
        else:
            context.window_manager.progress_update(round(100 * self._run.overall))
            context.workspace.status_text_set(f"Relume: {self._run.stage}, {self._run.overall:.0%}    Esc: cancel")
        return {"RUNNING_MODAL"}

    def cancel(self, context):  # Blender ends, or opens another file
        self.leave(context)

    def leave(self, context):
        global _running
        _running = None
        self._run.cancel()
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        context.workspace.status_text_set(None)


class Bake(Command, bpy.types.Operator):
    """Bake how light travels through the scene. Lamps may move afterwards; what is fixed may not"""

    bl_idname = "relume.bake"
    bl_label = "Bake"
    bl_options = {"UNDO"}

    def words(self, context):
        scene = context.scene
        settings = scene.relume_settings
        self._game = os.path.join(session_folder(), "game.glb")
        copied = texcoords.make_single_users(scene) if settings.texcoords else []
        if copied:
            self.report({"INFO"}, f"meshes of their own for {texcoords.listed(copied)}")
        words = ["bake", write_level(scene, self.warn), "-o", bake_path(scene), "--preset", settings.preset, "--export-glb", self._game]
        return words + (["--options", bpy.path.abspath(settings.options)] if settings.options else [])

    def done(self, context, run):
        self.report({"INFO"}, run.output.strip())
        if not context.scene.relume_settings.texcoords:
            return False
        put = texcoords.put_on_objects(context.scene, self._game)
        self.report({"INFO"}, str(put))
        return bool(put.cut)  # bent faces have other normals in two: this is the level that the bake is to be of


class Preview(Command, bpy.types.Operator):
    """Light the scene's camera's view with the bake and the lamps as they are now"""

    bl_idname = "relume.preview"
    bl_label = "Preview"

    def words(self, context):
        scene = context.scene
        if not os.path.exists(bake_path(scene)):
            raise program.RelumeError(f'there is no bake "{bake_path(scene)}": bake first')
        settings = scene.relume_settings
        self._picture = os.path.join(session_folder(), "preview.png")
        camera = ["--camera", scene.camera.name] if scene.camera else []  # relume frames a level that has none
        sky = world.sky(scene.world, session_folder(), self.warn)
        return ["render", write_level(scene, self.warn), "--bake", bake_path(scene), *camera, *sky, "--size",
                f"{settings.width}x{settings.height}", "--exposure", settings.exposure, "-o", self._picture]

    def done(self, context, run):
        image = bpy.data.images.get(PREVIEW)
        if image is None:
            image = bpy.data.images.load(self._picture)
            image.name = PREVIEW
        image.filepath = self._picture
        image.reload()
        self.show(context, image)
        self.report({"INFO"}, f'image "{PREVIEW}"')

    @staticmethod
    def show(context, image):
        """In an image editor that is open, or in a window of its own."""
        if bpy.app.background:
            return
        editors = [area for window in context.window_manager.windows for area in window.screen.areas if area.type == "IMAGE_EDITOR"]
        if not editors:
            bpy.ops.wm.window_new()
            editors = [context.window_manager.windows[-1].screen.areas[0]]
            editors[0].type = "IMAGE_EDITOR"
        editors[0].spaces.active.image = image


class Export(Command, ExportHelper, bpy.types.Operator):
    """Write the level with its light-map coordinates, and its bake beside it, for the game"""

    bl_idname = "relume.export"
    bl_label = "Export Level and Bake"
    filename_ext = ".glb"

    filter_glob: bpy.props.StringProperty(default="*.glb", options={"HIDDEN"})

    @property
    def bake(self):
        """Beside the level."""
        return os.path.splitext(self.filepath)[0] + ".relume"

    def words(self, context):
        if not os.path.exists(bake_path(context.scene)):
            raise program.RelumeError(f'there is no bake "{bake_path(context.scene)}": bake first')
        if os.path.exists(self.bake) and not is_bake(self.bake):
            raise program.RelumeError(f'"{self.bake}", where the bake goes, is something else; choose another name')
        return ["export", write_level(context.scene, self.warn), bake_path(context.scene), "-o", self.filepath]

    def done(self, context, run):
        if not (os.path.exists(self.bake) and os.path.samefile(self.bake, bake_path(context.scene))):
            shutil.copyfile(bake_path(context.scene), self.bake + ".part")
            os.replace(self.bake + ".part", self.bake)
        self.report({"INFO"}, f"{run.output.strip()}; {self.bake}")

    def invoke(self, context, event):  # a file is asked for, then execute() is called
        return ExportHelper.invoke(self, context, event)


CLASSES = (Bake, Preview, Export)
