// SPDX-License-Identifier: MIT
// Options of light without a bake by reflective shadow maps: `relume render --live --live-transport rsm`.
#pragma once

#include "relume/result.h"
#include "tools/render/render_frame.h"

#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace relume {

struct RsmFlags {
  std::string transport = "voxels", occupancy = "voxels", visibility = "sampled";
  RsmRequest request;
  std::vector<CLI::Option*> options;  // of the command, which nothing but transport by maps reads
};

// `live` is the option that all of them need. `flags` must outlive the parsing, and the command readRsm().
void addRsmFlags(CLI::App& command, CLI::Option* live, RsmFlags& flags);

// The request with the bands and bounces of `render`; nothing for transport by voxels. usage: bands that caches of
// cells do not have or that transport by voxels does not know, another of these options with it, occupancy by depth for
// more than one bounce.
Result<std::optional<RsmRequest>> readRsm(const RsmFlags& flags, const Bands& bands, int bounces);

}  // namespace relume
