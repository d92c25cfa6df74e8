// SPDX-License-Identifier: MIT
// See verify_bake.h.
#include "tools/cli/verify_bake.h"

#include "bake/base/parallel.h"
#include "formats/chunks.h"
#include "relume/bake/bake.h"
#include "relume/bake_file.h"

#include <string>

namespace relume {

Status verifyBake(const Scene& scene, const BakeOptions& options, const Bake& baked, Context& context) {
  Context other;
  const int threads = context.threads > 0 ? context.threads : coresOfProcess();
  other.threads = threads == 1 ? 2 : 1;
  other.maxMemory = context.maxMemory;
  other.onProgress = [&](std::string_view stage, double fraction) {
    return context.progress("verify: " + std::string(stage), fraction);
  };
  const Result<Bake> again = bake(scene, options, other);
  if (!again) return again.error();
  const Result<std::vector<std::byte>> first = serializeBake(baked), second = serializeBake(*again);
  if (!first) return first.error();
  if (!second) return second.error();
  if (*first == *second) return done();

  const auto a = readChunks(*first), b = readChunks(*second);
  std::string where = "the header";
  for (std::size_t i = 0; a && b && i < std::min(a->size(), b->size()); ++i) {
    if ((*a)[i].info.hash == (*b)[i].info.hash && (*a)[i].info.bytes == (*b)[i].info.bytes) continue;
    where = "array " + (*a)[i].info.name;
    break;
  }
  return Error{ErrorCode::failed, "not deterministic: a second bake on " + std::to_string(other.threads) +
                                      (other.threads == 1 ? " thread" : " threads") + " gives other bytes, first in " +
                                      where};
}

}  // namespace relume
