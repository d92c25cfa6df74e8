// SPDX-License-Identifier: MIT
// The frames that a picture by light without a bake takes, on the CPU (NestedCaches) and in OpenGL (LiveCachesGl).
#pragma once

#include "relume/bake/context.h"
#include "relume/result.h"
#include "runtime/live/live_frame.h"

#include <algorithm>
#include <cstdint>

namespace relume {

inline constexpr int kLiveSettling = 24;   // frames whose caches are not kept: bounces add up
inline constexpr int kLiveConverged = 64;  // frames in all, the others averaged
inline constexpr int kLiveOfABounce = 32;  // frames of each bounce, where they are counted

// Some frames of one bounce, or of unreflected light: averaged rays over voxels that stay as they are. The first set of
// rays is `set`.
template <class Caches, class Volume>
Status gatherOnce(Caches& light, Volume& volume, LiveFrame frame, int set, int frames, Context& context) {
  for (int f = 0; f < frames && !context.cancelled(); ++f) {
    frame.freezeVoxels = f > 0;
    frame.keep = static_cast<float>(f) / static_cast<float>(f + 1);
    frame.raySet = static_cast<std::uint32_t>(set + f);
    if (Status ok = light.update(volume, frame); !ok) return ok;
  }
  return done();
}

template <class Caches, class Volume>
Status converge(Caches& light, Volume& volume, LiveFrame frame, Context& context) {
  for (int f = 0; f < kLiveConverged && !context.cancelled(); ++f) {
    const auto kept = static_cast<float>(std::max(f - kLiveSettling, 0));
    frame.keep = kept / (kept + 1.0f);
    frame.raySet = static_cast<std::uint32_t>(f);
    if (Status ok = light.update(volume, frame); !ok) return ok;
  }
  return done();
}

// Light `all` until bounces and rays have converged, or for so many bounces [0 = converged]; and `straight`, if there
// is one, by what comes unreflected from emission and sky. lightDirectly(): finds direct light, for `all`. Returns how
// many frames `all` took.
template <class Caches, class Volume, class LightDirectly>
Result<int> convergeLive(Caches& all, Caches* straight, Volume& volume, LiveFrame frame, int bounces,
                         const LightDirectly& lightDirectly, Context& context) {
  frame.bounceScale = 0.0f;
  if (straight != nullptr) {
    // By the rays that average the rest, so that their difference has none of their noise.
    const int set = bounces > 0 ? 0 : kLiveSettling,
              count = bounces > 0 ? kLiveOfABounce : kLiveConverged - kLiveSettling;
    if (Status ok = gatherOnce(*straight, volume, frame, set, count, context); !ok) return ok.error();
  }
  if (Status ok = lightDirectly(); !ok) return ok.error();
  for (int bounce = 0; bounce < bounces; ++bounce) {
    frame.bounceScale = bounce > 0 ? 1.0f : 0.0f;
    if (Status ok = gatherOnce(all, volume, frame, 0, kLiveOfABounce, context); !ok) return ok.error();
  }
  if (bounces > 0) return bounces * kLiveOfABounce;
  frame.bounceScale = 1.0f;
  if (Status ok = converge(all, volume, frame, context); !ok) return ok.error();
  return kLiveConverged;
}

}  // namespace relume
