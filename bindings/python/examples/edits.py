#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# %% [markdown]
# # A wall is taken away
# The wall between two rooms goes, and their bake is stale until it is made again. Two lights without a bake, of the level as
# it was and as it is, say what has changed, and correct the bake's light there.
#
#     relume bake samples/level/two_rooms.glb -o level.relume
#     python3 edits.py samples/level/two_rooms.glb level.relume
#
# Cells begin at `# %%`; editors that know them, and jupytext, open this file as a notebook. Needs numpy.

# %%
import sys

import numpy

import relume
from rays import Shadows, parts_of

if len(sys.argv) != 3:
    sys.exit(f'usage: {sys.argv[0]} LEVEL.glb LEVEL.relume')
level, bake_file = sys.argv[1:]
parts = parts_of(level)
gone = [i for i, part in enumerate(parts) if part.name in ('living_wall_east', 'hall_wall_west', 'doorway')]

# %% [markdown]
# ## Light without a bake
# A surface, a mesh and a part for each node. What is beside the rooms does not matter here: the box leaves it out.

# %%
cells = 16
box = numpy.float32([(-0.2, -0.2, -0.2), (8.6, 3.0, 4.2)])
surfaces = [relume.Surface(part.albedo) for part in parts]
meshes = [relume.Mesh(part.corners.reshape(-1, 3), numpy.arange(3 * len(part.corners)).reshape(-1, 3), i)
          for i, part in enumerate(parts)]
before, after = (relume.LiveLight(surfaces, meshes, [relume.Part(i) for i in range(len(parts))], cells=cells, box=box)
                 for _ in range(2))
after.edit({i: None for i in gone})

# %% [markdown]
# ## What the edit changes where
# From the boxes of the parts that are gone. A part that is moved has two, where it was and where it is.

# %%
bounds = [(parts[i].corners.min(axis=(0, 1)), parts[i].corners.max(axis=(0, 1))) for i in gone]
blend = relume.EditBlend(bounds, voxel=(box[1] - box[0]).max() / (4 * cells))

# %% [markdown]
# ## Frames
# The bake and both lights take the lights and shadows of the level as it is: here a lamp in the living room, which the wall
# no longer hides from the hall. What is small and round casts no shadow here: rays in numpy are slow.

# %%
lamp = relume.Light.point((4.5, 1.7, 0.55), (3.0, 2.2, 1.3))
standing = numpy.concatenate([part.corners for i, part in enumerate(parts) if i not in gone and len(part.corners) < 50])
shadows = Shadows([lamp], standing, away=100.0)
relighter = relume.Relighter(relume.Bake(bake_file))
for frame in range(24):
    relighter.relight([lamp], shadows, emission_scale=0)
    for light in (before, after):
        light.update([lamp], shadows, keep=0.0 if frame == 0 else 0.8)

# %% [markdown]
# ## Along the floor of both rooms
# The wall stood at 5 m. Light without a bake is known near surfaces: what moves through the air keeps the bake's.

# %%
x = numpy.linspace(0.4, 7.8, 38)
walk = numpy.stack([x, numpy.zeros_like(x), numpy.full_like(x, 3.75)], axis=1)
up = numpy.tile((0.0, 1.0, 0.0), (len(x), 1))
share = blend.share(walk)
stale, live = relighter.irradiance_in_grid(walk, up), after.irradiance(walk, up)
corrected = blend.irradiance(share, stale, before.irradiance(walk, up), live)

# %%
print(f'{"x [m]":>6}{"stale":>10}{"corrected":>10}{"live":>10}{"change":>8}   mean of R, G, B [W/m2]')
for i in range(len(x)):
    print(f'{x[i]:6.2f}{stale[i].mean():10.4f}{corrected[i].mean():10.4f}{live[i].mean():10.4f}{share[i, 0]:8.2f}')
