// SPDX-License-Identifier: MIT
// See check_options.h.
#include "runtime/check_options.h"

#include "formats/decimal.h"
#include "formats/sh.h"
#include "formats/validate.h"
#include "runtime/backend.h"
#include "runtime/shared/look_turns.h"
#include "runtime/shared/usage_error.h"

#include <bit>
#include <string>
#include <utility>

namespace relume {
namespace {

// The parts a frame needs; names and the rest of the provenance stay with the host.
Bake shareArrays(const Bake& bake) {
  Bake shared;
  shared.surfels = bake.surfels;
  shared.hierarchy = bake.hierarchy;
  shared.caches = bake.caches;
  shared.caches.lightmap.parts = {};
  shared.caches.lightmap.cornerUv = shared.caches.lightmap.backCornerUv = {};
  shared.links = bake.links;
  shared.emitters = bake.emitters;
  shared.provenance.sceneHash = bake.provenance.sceneHash;
  return shared;
}

// Bands to light with: what was asked for, or what the bake recommends, held against each other and the links.
Status chooseBands(const Bake& bake, const RelightOptions& options, int& luma, int& chroma) {
  const bool sh = bake.links.kind == LinkKind::sh;
  const int max = sh ? static_cast<int>(bake.links.bands) : kMaxBands;
  if (options.lumaBands < 0 || options.lumaBands > max) {
    return usageError("lumaBands is " + std::to_string(options.lumaBands) + ", expected 1 to " + std::to_string(max) +
                      (sh ? ", the bands of the bake's SH links," : "") + " or 0 for the bake's choice");
  }
  const auto recommended = [](std::uint32_t bands, int limit) {
    return bands < 1 ? 1 : (bands > static_cast<std::uint32_t>(limit) ? limit : static_cast<int>(bands));
  };
  luma = options.lumaBands > 0 ? options.lumaBands : recommended(bake.provenance.lumaBands, max);
  if (options.chromaBands < 0 || options.chromaBands > luma) {
    return usageError("chromaBands is " + std::to_string(options.chromaBands) +
                      ", expected 1 to lumaBands = " + std::to_string(luma) + " or 0 for the bake's choice");
  }
  chroma = options.chromaBands > 0 ? options.chromaBands : recommended(bake.provenance.chromaBands, luma);
  return done();
}

}  // namespace

Result<CheckedOptions> checkOptions(const Bake& bake, const RelightOptions& options,
                                    std::pmr::memory_resource* memory) {
  if (const Status ok = checkBake(bake, memory); !ok)
    return Error{ok.error().code, "bake cannot be lit: " + ok.error().message};
  CheckedOptions checked{shareArrays(bake), {}, ImageSizes(memory)};
  if (Status ok = chooseBands(bake, options, checked.bands.lumaBands, checked.bands.chromaBands); !ok)
    return ok.error();
  checked.bands.irradianceOnMap = bake.links.kind == LinkKind::irradiance;
  checked.bands.glossy = options.glossy;
  if (!(options.gridTrust >= 0.0f && options.gridTrust <= 1.0f))
    return usageError("gridTrust is " + decimal(options.gridTrust) + ", expected 0 to 1");
  if (options.movingParts > kMaxMovingParts)
    return usageError("movingParts is " + std::to_string(options.movingParts) + ", expected 0 to " +
                      std::to_string(kMaxMovingParts));
  if (!std::has_single_bit(options.movingLag) || options.movingLag > kMaxMovingLag)
    return usageError("movingLag is " + std::to_string(options.movingLag) + ", expected a power of two up to " +
                      std::to_string(kMaxMovingLag));
  if (options.movingParts > 0 && !kHasMovingParts)
    return Error{ErrorCode::unsupported, "movingParts is " + std::to_string(options.movingParts) +
                                             ", expected 0: this build has no moving parts"};
  Result<ImageSizes> sizes = declareImages(bake.emitters, options.drivenImages, memory);
  if (!sizes) return sizes.error();
  checked.images = std::move(*sizes);
  return checked;
}

}  // namespace relume
