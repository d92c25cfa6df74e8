#!/bin/sh
# SPDX-License-Identifier: MIT
# Remakes the reference images of the shipped level: make_references.sh RELUME_BINARY. A minute or two.
set -eu
relume=$1
here=$(cd "$(dirname "$0")" && pwd)
out=$here/references/two_rooms
mkdir -p "$out"
for view in cam_living__sun cam_living__lamp cam_hall__spot cam_hall__emissive; do
  "$relume" reference "$here/../../samples/level/two_rooms.glb" --camera "${view%%__*}" --lights "${view#*__}" \
    --dynamic receivers --size 128x72 --spp 1024 --bounces 16 --half --progress none -o "$out/$view.exr"
done
