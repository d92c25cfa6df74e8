#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The add-on's manifest as Blender 4.2 and later want it: docs.blender.org/manual/en/4.2/advanced/extensions/
getting_started.html ("Manifest") and tags.html, by which `blender --command extension validate` refuses what is not so.
    manifest_test.py ADDON.zip"""
import re
import sys
import tomllib
import zipfile

TAGS = {'3D View', 'Add Curve', 'Add Mesh', 'Animation', 'Bake', 'Camera', 'Compositing', 'Development', 'Game Engine',
        'Geometry Nodes', 'Grease Pencil', 'Import-Export', 'Lighting', 'Material', 'Modeling', 'Mesh', 'Node', 'Object',
        'Paint', 'Pipeline', 'Physics', 'Render', 'Rigging', 'Scene', 'Sculpt', 'Sequencer', 'System', 'Text Editor',
        'Tracking', 'User Interface', 'UV'}
PERMISSIONS = {'files', 'network', 'clipboard', 'camera', 'microphone'}
REQUIRED = {'schema_version', 'id', 'version', 'name', 'tagline', 'maintainer', 'type', 'blender_version_min', 'license'}
OPTIONAL = {'website', 'tags', 'blender_version_max', 'copyright', 'permissions', 'platforms', 'wheels', 'build'}
VERSION = re.compile(r'(0|[1-9]\d*)\.(0|[1-9]\d*)\.(0|[1-9]\d*)([-+][0-9A-Za-z.+-]+)?')


def problems(manifest):
    """What of a manifest Blender would refuse."""
    found = [f'{key} is missing' for key in sorted(REQUIRED - manifest.keys())]
    found += [f'{key} is not known' for key in sorted(manifest.keys() - REQUIRED - OPTIONAL)]
    if found:
        return found

    def short(text, what):
        return [] if 0 < len(text) <= 64 and re.search(r'[\w)]$', text) and text == text.strip() else [
            f'{what} has to be of 1 to 64 characters and end without punctuation: "{text}"']

    if manifest['schema_version'] != '1.0.0':
        found.append('schema_version is not 1.0.0')
    if not re.fullmatch(r'[A-Za-z][A-Za-z0-9]*(_[A-Za-z0-9]+)*', manifest['id']):
        found.append('id is no identifier of Python, or has two underscores in a row or one at an end')
    for key in ('version', 'blender_version_min', 'blender_version_max'):
        if key in manifest and not VERSION.fullmatch(manifest[key]):
            found.append(f'{key} is no semantic version')
    if not found and tuple(int(n) for n in manifest['blender_version_min'].split('.')) < (4, 2, 0):
        found.append('blender_version_min: there are no extensions before 4.2.0')
    if manifest['type'] != 'add-on':
        found.append('type is not add-on')
    found += short(manifest['tagline'], 'tagline')
    if not manifest['name'].strip() or not manifest['maintainer'].strip():
        found.append('name or maintainer is empty')
    found += [f'tag {tag} is none of Blender\'s' for tag in manifest.get('tags', []) if tag not in TAGS]
    if not manifest['license'] or not all(re.fullmatch(r'SPDX:[A-Za-z0-9.+-]+', each) for each in manifest['license']):
        found.append('license is no list of SPDX:NAME')
    for name, reason in manifest.get('permissions', {}).items():
        found += [] if name in PERMISSIONS else [f'permission {name} is none of Blender\'s']
        found += short(reason, f'the reason for {name}')
    return found


def main():
    with zipfile.ZipFile(sys.argv[1]) as archive:
        names = archive.namelist()
        inside = next(name for name in names if name.rsplit('/', 1)[-1] == 'blender_manifest.toml')
        text = archive.read(inside).decode('utf8')
    # At the top, or all of it in one folder.
    folder = inside.removesuffix('blender_manifest.toml')
    assert folder.count('/') <= 1 and all(name.startswith(folder) for name in names), names
    assert folder + '__init__.py' in names, names
    manifest = tomllib.loads(text)
    assert not problems(manifest), problems(manifest)

    # And what it does not want is found.
    for key, value in (('tagline', 'Ends with a stop.'), ('tagline', 'x' * 65), ('tags', ['Baking']), ('license', ['MIT']),
                       ('license', []), ('blender_version_min', '4.1.0'), ('version', '0.2'), ('id', 'relume-addon'),
                       ('permissions', {'disk': 'Write'}), ('permissions', {'files': 'Write it.'}), ('author', 'x')):
        assert problems({**manifest, key: value}), (key, value)
    for key in REQUIRED:
        assert problems({k: v for k, v in manifest.items() if k != key}), key
    print(f'{inside}: {manifest["id"]} {manifest["version"]}')


main()
