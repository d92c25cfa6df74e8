#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# The Debian packages on a bare Debian 12, where nothing is but what their dependencies bring:
#   1. librelume alone runs a C program that was built against librelume-dev: the light that it gives here
#   2. relume-tools bakes the sample level: the bytes of the bake that was made here
#   3. librelume-bake-dev and a compiler build a program that bakes the level: the same bytes again
#   tests/packages_bare.sh [BUILD]      BUILD: a release build of everything, by default build/release
# Takes some minutes and about 2 GB below BUILD, which are removed again. Needs root, debootstrap and the Debian archive that
# this machine's apt uses. Exit status 77: skipped, saying why.
set -euo pipefail
cd "$(dirname "$0")/.."
build=$(realpath "${1:-build/release}")
relume=$build/tools/cli/relume
export LC_ALL=C DEBIAN_FRONTEND=noninteractive

skip() { echo "tests/packages_bare.sh: skipped: $*" >&2; exit 77; }
fail() { echo "tests/packages_bare.sh: $*" >&2; exit 1; }
step() { printf -- '-- %s (%s s so far)\n' "$1" "$SECONDS"; }

[ -x "$relume" ] || fail "there is no $relume: build first"
[ "$(. /etc/os-release && echo "$ID $VERSION_ID")" = "debian 12" ] || skip "packages that are built here are not for Debian 12"
[ "$(id -u)" -eq 0 ] || skip "not root"
for tool in debootstrap cpack dpkg-deb chroot mount pkg-config; do
  command -v "$tool" >/dev/null || [ -x "/usr/sbin/$tool" ] || skip "$tool is missing"
done
PATH=$PATH:/usr/sbin:/sbin

work=$(mktemp -d "$build/packages_bare.XXXXXX")
root=$work/root
clean_up() {
  local mounted
  for mounted in $(awk -v root="$root/" 'index($2, root) == 1 { print $2 }' /proc/mounts | sort -r); do
    umount "$mounted" || exit 1  # nothing is removed through a mount
  done
  rm -rf --one-file-system "$work"
}
trap clean_up EXIT

# Whatever fails after this says so with the log's last lines.
quietly() { "$@" >"$work/log" 2>&1 || { tail -n 20 "$work/log" >&2; return 1; }; }
inside() { chroot "$root" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C "$@"; }
install() {
  quietly chroot "$root" apt-get install -y -qq --no-install-recommends "$@" || fail "apt-get install $*: failed"
}
installed() { inside dpkg-query -W -f='${Package}\n' | grep -E "$1" || true; }
light() { sed -n 's/ *[0-9.]* ms$//; /^frame/p' "$1"; }

step "packages"
quietly cpack -G DEB -B "$work/debs" --config "$build/CPackConfig.cmake" || fail "cpack failed"
rm -rf "$work/debs/_CPack_Packages"
declare -A deb
for file in "$work"/debs/*.deb; do deb[$(dpkg-deb -f "$file" Package)]=$file; done
runtime=$(printf '%s\n' "${!deb[@]}" | grep -E '^librelume[0-9.]+$') || fail "no package of the runtime among: ${!deb[*]}"

step "a bare Debian 12"
archives() { apt-get indextargets --format "$1" 'Origin: Debian' 'Component: main' 'Created-By: Packages' | sort -u; }
mirror=$(archives '$(CODENAME) $(REPO_URI)' | sed -n 's/^bookworm //p' | head -n 1)
[ -n "$mirror" ] || skip "apt of this machine has no Debian 12 archive (apt-get update?)"
quietly debootstrap --variant=minbase bookworm "$root" "$mirror" || skip "debootstrap from $mirror failed"
quietly mount -t proc proc "$root/proc" || skip "/proc cannot be mounted"
archives 'deb $(REPO_URI) $(CODENAME) $(COMPONENT)' >"$root/etc/apt/sources.list"
apt-config dump | grep '^Acquire::' >"$root/etc/apt/apt.conf.d/50host" || true
cp -L /etc/resolv.conf /etc/hosts "$root/etc/"
quietly chroot "$root" apt-get update -qq || skip "apt-get update in the bare system failed"
mkdir "$root/work"
cp "${deb[@]}" samples/level/two_rooms.glb "$root/work/"
in_root() { echo "/work/$(basename "${deb[$1]}")"; }

step "1. $runtime alone: a C program"
options=(--preset draft --surfels 512 --lightmap-caches 200 --links 64 --rays 64 --walks 5000)
quietly "$relume" bake samples/level/two_rooms.glb -o "$work/here.relume" "${options[@]}" || fail "relume bake failed here"
for package in "$runtime" librelume-dev; do dpkg-deb -x "${deb[$package]}" "$work/unpacked"; done
pc=$(dirname "$(find "$work/unpacked" -name relume.pc)")
# shellcheck disable=SC2046
cc -std=c89 samples/02_hello_c/hello_relight.c -o "$work/hello" $(PKG_CONFIG_PATH=$pc pkg-config --cflags --libs relume) -lm
LD_LIBRARY_PATH=$(dirname "$pc") "$work/hello" "$work/here.relume" >"$work/hello.here"
[ "$(light "$work/hello.here" | wc -l)" -eq 16 ] || fail "the C program gives no light here"
install "$(in_root "$runtime")"
brought=$(installed 'embree|tbb|cgal|flann|libglm|epoxy|-dev$')
[ -z "$brought" ] || fail "the runtime brought $brought"
cp "$work/hello" "$work/here.relume" "$root/work/"
inside /work/hello /work/here.relume >"$work/hello.bare"
diff <(light "$work/hello.here") <(light "$work/hello.bare") || fail "the light of the C program differs"

step "2. relume-tools: a bake"
install "$(in_root relume-tools)"
quietly inside relume bake /work/two_rooms.glb -o /work/bare.relume "${options[@]}" || fail "relume bake failed"
cmp "$work/here.relume" "$root/work/bare.relume" || fail "the bake's bytes differ"
inside relume validate /work/bare.relume
inside relume-view --version

step "3. librelume-bake-dev: a program that bakes"
install "$(in_root librelume-dev)" "$(in_root librelume-bake-dev)" g++ cmake ninja-build
cp -r tests/consumer/baking "$root/work/"
quietly inside cmake -G Ninja -S /work/baking -B /work/baking_build || fail "the program is not configured"
quietly inside cmake --build /work/baking_build || fail "the program is not built"
inside /work/baking_build/bake_level /work/two_rooms.glb /work/library.relume draft surfels.count=512 \
  caches.lightmapCaches=200 links.linksPerCache=64 links.raysPerCache=64 playSpace.walks=5000
cmp "$work/here.relume" "$root/work/library.relume" || fail "the bytes of the library's bake differ"
step "packages of bare Debian 12: all well"
