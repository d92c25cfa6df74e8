// SPDX-License-Identifier: MIT
// See rsm_flags.h.
#include "tools/cli/rsm_flags.h"

#include "tools/base/number_check.h"
#include "tools/base/usage_message.h"

#include <CLI/CLI.hpp>

namespace relume {
void addRsmFlags(CLI::App& command, CLI::Option* live, RsmFlags& flags) {
  RsmRequest& r = flags.request;
  command
      .add_option("--live-transport", flags.transport,
                  "how light gets to the cells with --live: voxels, by rays that meet lit voxels, with all bounces and "
                  "emitters; rsm, from reflective shadow maps of the punctual lights, as Vardis et al. print it")
      ->check(CLI::IsMember({"voxels", "rsm"}))
      ->needs(live)
      ->capture_default_str();
  flags.options = {
      command
          .add_option(
              "--rsm-size", r.side,
              "texels along a side of a reflective shadow map, with --live-transport rsm; left out, 256, or 512 where "
              "the maps light voxels as well: with --gloss, --aov glossy or voxels, in light that is reflected once")
          ->check(CLI::Range(16, 2048)),
      command.add_option("--rsm-samples", r.options.samples, "samples of all maps for a cell in each frame")
          ->check(CLI::Range(1, 4096))
          ->capture_default_str(),
      command
          .add_option("--rsm-frames", r.frames, "frames of other samples that are averaged; 1 = as one frame shows it")
          ->check(CLI::Range(1, 1024))
          ->capture_default_str(),
      command
          .add_option("--occupancy", flags.occupancy,
                      "which cells are lit, with --live-transport rsm: all (none), those with voxels and their "
                      "neighbours (voxels), those that the camera sees and their neighbours (depth; with --bounces 1)")
          ->check(CLI::IsMember({"none", "voxels", "depth"}))
          ->capture_default_str(),
      command
          .add_option("--live-visibility", flags.visibility,
                      "what hides light from a cell, with --live-transport rsm: nothing (none), voxels at a few places "
                      "of its way (sampled), all voxels on it (exact)")
          ->check(CLI::IsMember({"none", "sampled", "exact"}))
          ->capture_default_str(),
      command.add_option("--presence", r.presence, "factor on the light of the cells, with --live-transport rsm")
          ->check(numberFrom(0.0, 100.0))
          ->capture_default_str(),
      command.add_option("--bleeding", r.bleeding, "factor on its colour, with --live-transport rsm; 0 = grey")
          ->check(numberFrom(0.0, 100.0))
          ->capture_default_str()};
  for (CLI::Option* const option : flags.options) option->needs(live);
}

Result<std::optional<RsmRequest>> readRsm(const RsmFlags& flags, const Bands& bands, int bounces) {
  if (flags.transport == "voxels") {
    for (const CLI::Option* const option : flags.options) {
      if (option->count() > 0) return usage(option->get_name() + " needs --live-transport rsm");
    }
    if (bands.luma > 0) return usage("--bands with --live needs --live-transport rsm");
    return std::optional<RsmRequest>();
  }
  RsmRequest request = flags.request;
  if (bands.luma > kMaxFieldBands)
    return usage("--bands " + bandsName(bands) + ": with --live-transport rsm cells have " +
                 std::to_string(kMaxFieldBands) + " bands at most");
  if (bands.luma > 0) request.options.bands = bands;
  request.options.occupancy = flags.occupancy == "none"    ? CellOccupancy::none
                              : flags.occupancy == "depth" ? CellOccupancy::depth
                                                           : CellOccupancy::voxels;
  request.options.visibility = flags.visibility == "none"    ? CellVisibility::none
                               : flags.visibility == "exact" ? CellVisibility::exact
                                                             : CellVisibility::sampled;
  if (request.options.occupancy == CellOccupancy::depth && bounces != 1)
    return usage("--occupancy depth serves light that is reflected once: --bounces 1");
  return std::optional(request);
}

}  // namespace relume
