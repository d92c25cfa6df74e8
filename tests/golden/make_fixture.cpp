// SPDX-License-Identifier: MIT
// Writes the fixture of the current format version: the small bake of the tests. tests/golden/remake.sh runs it.
#include "formats/bake_file.h"
#include "tests/formats/small_bake.h"

#include <cstdio>

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: make_fixture CONE.relume SH.relume\n");
    return 1;
  }
  const relume::LinkKind kinds[] = {relume::LinkKind::cone, relume::LinkKind::sh};
  for (int i = 0; i < 2; ++i) {
    const relume::Status status = relume::writeBake(relume::makeSmallBake(kinds[i]), argv[i + 1]);
    if (!status) {
      std::fprintf(stderr, "%s\n", status.error().message.c_str());
      return 2;
    }
  }
  return 0;
}
