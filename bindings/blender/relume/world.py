# SPDX-License-Identifier: MIT
"""The scene's world as options of `relume render`: a colour, or an equirectangular image that may be turned about Z. The user is told of
what else a world has."""
import math
import os

import bpy
import numpy

_LINEAR = {"Linear", "Linear Rec.709", "Non-Color"}  # names of Blender's, before and since 4.0


def _link(socket):
    """The link into a socket, past the corners that the user drew it around; None where there is none."""
    link = socket.links[0] if socket.is_linked else None
    while link and link.from_node.type == "REROUTE":
        link = link.from_node.inputs[0].links[0] if link.from_node.inputs[0].is_linked else None
    return link


def _constant(color, strength=1.0):
    return ["--sky", ",".join(f"{strength * value:.9g}" for value in color[:3])]


def _scaled_copy(image, strength, path):
    """Writes what Blender holds of an image, in memory or in the .blend file, as OpenEXR."""
    (width, height), channels = image.size, image.channels
    values = numpy.empty(width * height * channels, numpy.float32)
    image.pixels.foreach_get(values)
    colors = values.reshape(-1, channels)[:, :3 if channels > 2 else 1]
    if not image.is_float and image.colorspace_settings.name == "sRGB":
        colors = numpy.where(colors <= 0.04045, colors / 12.92, ((colors + 0.055) / 1.055) ** 2.4)
    texels = numpy.ones((width * height, 4), numpy.float32)
    texels[:, :3] = strength * colors
    copy = bpy.data.images.new("Relume sky", width, height, float_buffer=True, is_data=True)
    try:
        copy.pixels.foreach_set(texels.ravel())
        copy.file_format, copy.filepath_raw = "OPEN_EXR", path
        copy.save()
    finally:
        bpy.data.images.remove(copy)
    return path


def _turned(socket, warn):
    """Degrees by which an Environment Texture's vector is turned about Z, counter-clockwise seen from above."""
    link, degrees = _link(socket), 0.0
    if link and link.from_node.type == "MAPPING":
        mapping = link.from_node
        place, angles, scale = (mapping.inputs[name] for name in ("Location", "Rotation", "Scale"))
        moved = any(place.default_value) and mapping.vector_type in {"POINT", "TEXTURE"}
        if moved or any(angles.default_value[:2]) or tuple(scale.default_value) != (1, 1, 1) or \
                place.is_linked or angles.is_linked or scale.is_linked:
            warn("of the world's Mapping node the preview takes the value of Rotation Z alone")
        degrees = math.degrees(angles.default_value[2]) * (-1 if mapping.vector_type == "TEXTURE" else 1)
        link = _link(mapping.inputs["Vector"])
        if link is None:
            warn("the world's Mapping node has no Vector: the preview takes the directions of Texture Coordinate, Generated")
    if link and (link.from_node.type, link.from_socket.name) not in {("TEX_COORD", "Generated"), ("TEX_COORD", "Object")}:
        warn(f'the preview turns the world\'s image by a Mapping node of Texture Coordinate, Generated, not by "{link.from_node.name}"')
    return degrees


def _environment(node, strength, folder, warn):
    image = node.image
    if node.projection != "EQUIRECTANGULAR":
        warn("the preview knows an Environment Texture that is equirectangular, no mirror ball: it is without a sky")
        return []
    if image is None or 0 in image.size:
        missing = f' "{image.filepath}"' if image else ""
        warn(f"the image{missing} of the world's Environment Texture is missing; the preview is without a sky")
        return []
    path = bpy.path.abspath(image.filepath, library=image.library)
    if strength != 1.0 or image.source != "FILE" or image.packed_file or image.is_dirty or not os.path.isfile(path) or \
            not path.lower().endswith((".exr", ".hdr")) or image.colorspace_settings.name not in _LINEAR:
        path = _scaled_copy(image, strength, os.path.join(folder, "sky.exr"))
    # Blender has an image's middle toward +X. Turning the vector that looks an image up turns what is seen the other way.
    degrees = (-90.0 - _turned(node.inputs["Vector"], warn)) % 360.0
    return ["--sky-map", path, "--sky-rotation", f"{degrees:.9g}"]


def sky(world, folder, warn):
    """The options. An image that is no linear file on disk, or is brighter or darker than that, is written into the folder. warn() gets
    sentences about what of the world is not in the picture."""
    if world is None:
        return []
    if not world.use_nodes:
        return _constant(world.color)
    output = next(filter(None, (world.node_tree.get_output_node(target) for target in ("ALL", "CYCLES", "EEVEE"))), None)
    surface = _link(output.inputs["Surface"]) if output else None
    if surface is None:
        return []
    background = surface.from_node
    if background.type != "BACKGROUND" or _link(background.inputs["Strength"]):
        warn(f'the preview knows a world whose Surface is a Background with a number as its Strength, not "{background.name}": it is '
             'without a sky')
        return []
    strength, color = background.inputs["Strength"].default_value, _link(background.inputs["Color"])
    if color is None:
        return _constant(background.inputs["Color"].default_value, strength)
    if color.from_node.type == "RGB":
        return _constant(color.from_node.outputs[0].default_value, strength)
    if color.from_node.type == "TEX_ENVIRONMENT":
        return _environment(color.from_node, strength, folder, warn)
    warn(f'the preview knows a world of one colour or of an Environment Texture, not "{color.from_node.name}": it is without a sky')
    return []
