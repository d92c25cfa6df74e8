// SPDX-License-Identifier: MIT
// Writes the fixture of the current format version: the small bake of the tests. tests/golden/remake.sh runs it.
#include "relume/bake_file.h"
#include "tests/formats/small_bake.h"

#include <cstdio>
#include <string>

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: make_fixture FOLDER\n");
    return 1;
  }
  for (const relume::LinkKind kind : relume::kLinkKinds) {
    const std::string path = std::string(argv[1]) + "/v3_" + std::string(relume::linkKindName(kind)) + ".relume";
    const relume::Status status = relume::writeBake(relume::makeSmallBake(kind), path);
    if (!status) {
      std::fprintf(stderr, "%s\n", status.error().message.c_str());
      return 2;
    }
  }
  const relume::Status status =
      relume::writeBake(relume::makeSmallDrivableBake(), std::string(argv[1]) + "/v4_cone.relume");
  if (!status) {
    std::fprintf(stderr, "%s\n", status.error().message.c_str());
    return 2;
  }
  return 0;
}
