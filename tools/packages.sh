# SPDX-License-Identifier: MIT
# Shell functions that samples/demo.sh and tests/run.sh share.

# With RELUME_CONFIGURE_ONLY=1 both end here, once the release build is configured: what their test needs.
end_if_configure_only() {
  if [ "${RELUME_CONFIGURE_ONLY:-0}" = 1 ]; then exit 0; fi
}

# install_packages LIST [optional|long]: install the Debian packages of a list file that are missing; needs root or sudo
# only then. The list goes to the line that starts with "# Optional"; `optional` installs those after it instead, up to
# the line that starts with "# Long", and `long` those after that, each for itself.
install_packages() {
  local wanted missing=() package
  case "${2:-}" in
    optional) wanted=$(sed -e '1,/^# Optional/d' -e '/^# Long/,$d' -e '/^#/d' "$1") ;;
    long) wanted=$(sed -e '1,/^# Long/d' -e '/^#/d' "$1") ;;
    *) wanted=$(sed -e '/^# Optional/,$d' -e '/^#/d' "$1") ;;
  esac
  for package in $wanted; do
    dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'install ok installed' || missing+=("$package")
  done
  [ ${#missing[@]} -eq 0 ] && return 0
  echo "Installing: ${missing[*]}"
  local sudo=()
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || { echo "Not root and no sudo: install the packages above, then run this again." >&2; return 1; }
    sudo=(sudo)
  fi
  if [ -z "${package_lists_are_new:-}" ]; then
    "${sudo[@]}" apt-get update -qq || [ -n "${2:-}" ]
    package_lists_are_new=1
  fi
  local install=("${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends) failed=0
  if [ -z "${2:-}" ]; then
    "${install[@]}" "${missing[@]}" >/dev/null
  elif ! "${install[@]}" "${missing[@]}" >/dev/null 2>&1; then
    for package in "${missing[@]}"; do "${install[@]}" "$package" >/dev/null || failed=1; done
    return "$failed"
  fi
}
