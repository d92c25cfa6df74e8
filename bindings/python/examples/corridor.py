#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# %% [markdown]
# # Light along a walk through two rooms
# One bake of the sample level, three lights that are switched at will: what arrives on a face that looks up, along a line
# from the living room's far wall through the doorway to the hall's.
#
#     relume bake samples/level/two_rooms.glb -o level.relume
#     python3 corridor.py samples/level/two_rooms.glb level.relume corridor.png
#
# Cells begin at `# %%`; editors that know them, and jupytext, open this file as a notebook. Needs numpy; matplotlib for the
# picture.

# %%
import sys

import numpy

import relume
from rays import Shadows, parts_of

if len(sys.argv) != 4:
    sys.exit(f'usage: {sys.argv[0]} LEVEL.glb LEVEL.relume PICTURE.png')
level, bake_file, picture = sys.argv[1:]


# %% [markdown]
# ## Shadows
# The library asks which points a light reaches, many at a time; how that is found is the host's business. A game has shadow
# maps. Here, rays go to the light through the level's triangles, all at once in numpy: `rays.py`.

# %% [markdown]
# ## Lights
# Those of the level: a sun through the window, a lamp in the living room, a spot in the hall. Intensities are radiometric.

# %%
sun = relume.Light.directional((0.212404, -0.598594, 0.772379), (14.0, 13.0, 11.2))
lamp = relume.Light.point((4.5, 1.7, 0.55), (3.0, 2.2, 1.3))
spot = relume.Light.spot((7.6, 2.5, 3.3), (-0.196012, -0.490029, -0.849383), (20.9, 21.3, 22.0), inner_cone=0.28,
                         outer_cone=0.42)
lights = {'sun': sun, 'lamp': lamp, 'spot': spot}

# %%
bake = relume.Bake(bake_file)
relighter = relume.Relighter(bake)
corners = numpy.concatenate([part.corners for part in parts_of(level)])
shadows = Shadows(list(lights.values()), corners, away=100.0)

x = numpy.linspace(0.3, 7.9, 153)
walk = numpy.stack([x, numpy.full_like(x, 1.0), numpy.full_like(x, 1.7)], axis=1)
up = numpy.tile((0.0, 1.0, 0.0), (len(x), 1))


def light_along_the_walk(scales):
    """Indirect irradiance on faces that look up [W/m2] (n, 3), by factors on the three lights; after twelve bounces."""
    dimmed = [relume.Light(**{**light.__dict__, 'intensity': tuple(scale * numpy.float32(light.intensity))})
              for light, scale in zip(lights.values(), scales)]
    relighter.reset()
    for _ in range(12):
        relighter.relight(dimmed, shadows, emission_scale=0)
    return relighter.irradiance_in_grid(walk, up)


curves = {name: light_along_the_walk(scales) for name, scales in
          (('sun', (1, 0, 0)), ('lamp', (0, 1, 0)), ('spot', (0, 0, 1)), ('all', (1, 1, 1)))}

# %% [markdown]
# Light adds up: the three curves sum to that of all lights within a percent; what few bands guess of further ones is not
# linear. The doorway is at 5 m.

# %%
together, added = curves['all'].sum(axis=1), sum(curves[n] for n in lights).sum(axis=1)
print(f'{"x [m]":>6}' + ''.join(f'{name:>9}' for name in curves) + '   mean of R, G, B [W/m2]')
for i in range(0, len(x), 19):
    print(f'{x[i]:6.2f}' + ''.join(f'{curves[name][i].mean():9.4f}' for name in curves))
print(f'largest difference of the sum: {numpy.abs(together - added).max() / together.max():.1e}')

# %%
try:
    import matplotlib
except ImportError:
    sys.exit('matplotlib is not installed: no picture')
matplotlib.use('agg')
import matplotlib.pyplot as plot

figure, axes = plot.subplots(figsize=(9, 4), layout='constrained')
for name, color in (('all', 'black'), ('sun', '#e08a00'), ('lamp', '#c03028'), ('spot', '#3060c0')):
    axes.plot(x, curves[name].mean(axis=1), color=color, label=name, linewidth=2 if name == 'all' else 1.5)
axes.axvspan(5.0, 5.2, color='0.85', label='doorway')
axes.set(xlabel='x [m]', ylabel='indirect irradiance, facing up [W/m²]', xlim=(x[0], x[-1]), ylim=(0, None),
         title='A walk through two rooms, one bake')
axes.legend()
figure.savefig(picture, dpi=120)
print(f'wrote {picture}')
