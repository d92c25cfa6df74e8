# SPDX-License-Identifier: MIT
"""RELUME_BUNDLE=PATH puts that librelume into the wheel, which is then one of this platform; without it the wheel is for
any, and the library is the one that the loader finds. Licences come from the sources around this folder."""
import glob
import os
import shutil

from setuptools import setup
from setuptools.command.build_py import build_py
from setuptools.dist import Distribution

BUNDLE = os.environ.get('RELUME_BUNDLE')
SOURCES = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..')
LICENCES = ['LICENSE'] + (['runtime/LICENSE.third-party'] if BUNDLE else [])  # the latter is of what the library has in it


class BuildWithLibrary(build_py):
    def run(self):
        super().run()
        package = os.path.join(self.build_lib, 'relume')
        for name in LICENCES:
            if os.path.exists(os.path.join(SOURCES, name)):
                shutil.copy(os.path.join(SOURCES, name), package)
        for older in glob.glob(os.path.join(package, '*relume.*')):  # of another build in this folder
            os.remove(older)
        if BUNDLE:
            shutil.copyfile(BUNDLE, os.path.join(package, os.path.basename(os.path.realpath(BUNDLE))))


class PlatformDistribution(Distribution):
    def has_ext_modules(self):
        return bool(BUNDLE)


setup(cmdclass={'build_py': BuildWithLibrary}, distclass=PlatformDistribution)
