// SPDX-License-Identifier: MIT
// Writes the fixtures of the current format versions: the small bake of the tests. tests/golden/remake.sh runs it.
#include "relume/bake_file.h"
#include "tests/formats/small_bake.h"

#include <cstdio>
#include <string>
#include <vector>

int main(int argc, char** argv) {
  using namespace relume;
  if (argc != 2) {
    std::fprintf(stderr, "usage: make_fixture FOLDER\n");
    return 1;
  }
  const std::string folder = std::string(argv[1]) + "/";
  std::vector<Status> written;
  for (const LinkKind kind : kLinkKinds)
    written.push_back(writeBake(makeSmallBake(kind), folder + "v3_" + std::string(linkKindName(kind)) + ".relume"));
  written.push_back(writeBake(makeSmallDrivableBake(), folder + "v4_cone.relume"));
  written.push_back(
      writePackedBake(makeSmallDrivableBake(LinkKind::oct6), 0x0123456789ABCDEFull, folder + "v5_oct6.relume"));
  written.push_back(writeBake(makeSmallCertifiedBake(), folder + "v6_cone.relume"));
  written.push_back(
      writePackedBake(makeSmallCertifiedBake(LinkKind::oct6), 0x0123456789ABCDEFull, folder + "v7_oct6.relume"));
  written.push_back(writeBake(makeSmallSightedBake(), folder + "v8_cone.relume"));
  written.push_back(
      writePackedBake(makeSmallSightedBake(LinkKind::oct6), 0x0123456789ABCDEFull, folder + "v9_oct6.relume"));
  for (const Status& status : written) {
    if (status) continue;
    std::fprintf(stderr, "%s\n", status.error().message.c_str());
    return 2;
  }
  return 0;
}
