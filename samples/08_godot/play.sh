#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Start relight_server, and Godot with it.
#   play.sh LEVEL_GAME.glb LEVEL.relume [--screenshot=OUT.png] [--frames=N] [--show=all|direct|indirect] [--still]
# In a window until it is closed, or for so many frames, the last of which is the screenshot. LEVEL_GAME.glb is what
# `relume bake LEVEL.glb -o LEVEL.relume --export-glb LEVEL_GAME.glb` wrote. RELIGHT_SERVER, GODOT: the programs, where
# they are not on the PATH as relight_server, and as godot3-runner or godot3.
set -euo pipefail
[ $# -ge 2 ] || { echo "usage: play.sh LEVEL_GAME.glb LEVEL.relume [OPTIONS]" >&2; exit 1; }
level=$(realpath -m "$1") bake=$2
shift 2
options=()
for option in "$@"; do  # Godot works in the project's folder
  case "$option" in
    --screenshot=*) options+=("--screenshot=$(realpath -m "${option#*=}")") ;;
    *) options+=("$option") ;;
  esac
done
godot=${GODOT:-$(command -v godot3-runner || command -v godot3 || { echo "play.sh: no Godot 3" >&2; exit 5; })}
exec {server}< <(exec "${RELIGHT_SERVER:-relight_server}" "$bake")
pid=$!
trap 'kill "$pid" 2>/dev/null || true' EXIT
read -r port <&"$server" || { wait "$pid" && exit 4 || exit $?; }
rc=0
"$godot" --path "$(dirname "$(realpath "$0")")" --audio-driver Dummy --level="$level" --port="$port" "${options[@]}" || rc=$?
exit "$rc"
