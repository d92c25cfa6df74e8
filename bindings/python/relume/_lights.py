# SPDX-License-Identifier: MIT
"""Lights and their shadows, as a frame hands them over."""
from __future__ import annotations

import contextlib
from ctypes import byref, sizeof
from dataclasses import dataclass
from typing import Callable

import numpy
from numpy.typing import ArrayLike

from ._arrays import ByValue, Floats, three, whole
from ._library import CLight, LightSetup, Visibility, runtime
from ._signals import HeldSignals, counted

_DIRECTIONAL, _POINT, _SPOT = 0, 1, 2
Shadows = Callable[[int, Floats, Floats], ArrayLike]  # light, positions, normals: shares of the light that reach them


@dataclass(eq=False)
class Light(ByValue):
    """A punctual light as KHR_lights_punctual defines it; see the three constructors."""
    kind: int
    intensity: ArrayLike          # [W/sr], of a directional light [W/m2]
    position: ArrayLike = (0, 0, 0)  # [m]
    direction: ArrayLike = (0, -1, 0)  # the way the light travels, of length 1
    range: float = 0.0            # [m] 0 = no limit
    inner_cone: float = 0.0       # [radians]
    outer_cone: float = 0.7853982

    @classmethod
    def directional(cls, direction: ArrayLike, irradiance: ArrayLike) -> Light:
        """A sun; irradiance [W/m2] of a surface that faces it."""
        return cls(_DIRECTIONAL, irradiance, direction=direction)

    @classmethod
    def point(cls, position: ArrayLike, intensity: ArrayLike, range: float = 0.0) -> Light:
        """A lamp; intensity [W/sr]."""
        return cls(_POINT, intensity, position=position, range=range)

    @classmethod
    def spot(cls, position: ArrayLike, direction: ArrayLike, intensity: ArrayLike, inner_cone: float = 0.0,
             outer_cone: float = 0.7853982, range: float = 0.0) -> Light:
        """A spotlight; cones are angles from its axis [radians]."""
        return cls(_SPOT, intensity, position, direction, range, inner_cone, outer_cone)

    def _c(self):
        return CLight(whole('kind', self.kind, 2 ** 31), three('intensity', self.intensity), three('position', self.position),
                      three('direction', self.direction), self.range, self.inner_cone, self.outer_cone)


class Frame:
    """A LightSetup and what it points to: arrays that are kept, and handles that stay open while it runs."""

    def __init__(self, lights, visibility):
        if isinstance(lights, Light):
            raise TypeError('lights: a sequence of them expected, one Light found')
        for i, light in enumerate(lights):
            if not isinstance(light, Light):
                raise TypeError(f'lights[{i}]: a Light expected, {type(light).__name__} found')
        self.kept, self.handles, self.raised, self.signals = [], [], [], None
        self._asked, self._answered = None, []  # calls of `visibility`
        self.setup = LightSetup()
        runtime.relume_light_setup_default(byref(self.setup), sizeof(self.setup))
        self.setup.lights = (CLight * len(lights))(*[light._c() for light in lights])
        self.setup.light_count = len(lights)
        if visibility is not None:
            self.signals = HeldSignals()
            self._asked = counted(_visibility_call(visibility, self._answered, self.raised, self.signals))
            self.setup.visibility = Visibility(self._asked)

    def run(self, light, function, *arguments):
        """A function of the library that takes the handle of `light` first; what `visibility` has raised comes out here."""
        with contextlib.ExitStack() as running:
            handle, *_ = (running.enter_context(each._running()) for each in (light, *self.handles))
            status = light._context.run(function, handle, *arguments, signals=self.signals)
            if self.raised:
                raise self.raised.pop(0)  # not kept: its traceback keeps this Frame
            if self._asked and self._asked.cache_info().misses > len(self._answered):
                raise RuntimeError('an exception, which sys.unraisablehook was told, came before `visibility` had begun: some points '
                                   'are in shadow; reset() forgets that light')
            light._check(status)


def _visibility_call(visibility, answered, raised, signals):
    """`visibility` as the library calls it; what it raises goes to `raised`, as no exception may cross the library."""

    def call(_, light, count, positions, normals, visible):
        try:
            if not raised:
                answer(light, count, positions, normals, visible)
            answered.append(light)
        except BaseException as error:  # pylint: disable=broad-except
            raised.append(error)

    def answer(light, count, positions, normals, visible):
        points = [numpy.ctypeslib.as_array(p, (count, 3)) for p in (positions, normals)]
        for view in points:
            view.flags.writeable = False
        shares = signals.host(visibility, light, *points)
        if shares is None:  # numpy would take it for NaN
            raise TypeError(f'visibility returned None, shares of shape ({count},) expected')
        numpy.ctypeslib.as_array(visible, (count,))[:] = shares

    return call
