# SPDX-License-Identifier: MIT
"""RELUME_BUNDLE=PATH puts that librelume into the wheel, which is then one of this platform; without it the wheel is for
any, and the library is the one that the loader finds."""
import os
import shutil

from setuptools import setup
from setuptools.command.build_py import build_py
from setuptools.dist import Distribution

BUNDLE = os.environ.get('RELUME_BUNDLE')


class BuildWithLibrary(build_py):
    def run(self):
        super().run()
        if BUNDLE:
            shutil.copyfile(BUNDLE, os.path.join(self.build_lib, 'relume', os.path.basename(os.path.realpath(BUNDLE))))


class PlatformDistribution(Distribution):
    def has_ext_modules(self):
        return bool(BUNDLE)


setup(cmdclass={'build_py': BuildWithLibrary}, distclass=PlatformDistribution)
