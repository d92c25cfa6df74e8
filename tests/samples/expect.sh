# SPDX-License-Identifier: MIT
# Sourced by tests of samples, in a folder of their own.

expect() { # STATUS WORDS COMMAND...: the command exits with STATUS and says WORDS
  local status=$1 words=$2 rc=0
  shift 2
  "$@" 2>log.txt >/dev/null || rc=$?
  [ "$rc" -eq "$status" ] && grep -q "$words" log.txt || { echo "$*: exit $rc, expected $status and '$words':"; cat log.txt; exit 1; }
}

begin_on_screen() { # FOLDER: makes it anew and enters it, with a screen that nobody sees; ends with 77 where there is none
  command -v Xvfb >/dev/null || { echo "Xvfb is missing: skipped"; exit 77; }
  rm -rf "$1"
  mkdir -p "$1"
  cd "$1"
  Xvfb -displayfd 3 -screen 0 1280x720x24 -nolisten tcp 3>display.txt 2>xvfb.txt &
  screen=$!
  trap 'kill "$screen" 2>/dev/null || true' EXIT
  for _ in $(seq 100); do
    [ ! -s display.txt ] || break
    sleep 0.1
  done
  [ -s display.txt ] || { echo "no virtual screen: skipped"; cat xvfb.txt; exit 77; }
  DISPLAY=:$(cat display.txt)
  export DISPLAY
  unset WAYLAND_DISPLAY
}

bake_two_rooms() { # SOURCE RELUME: level.glb, its bake level.relume, and game.glb for it
  cp "$1/samples/level/two_rooms.glb" level.glb
  "$2" bake level.glb -o level.relume --preset draft --export-glb game.glb --progress none 2>/dev/null
}
