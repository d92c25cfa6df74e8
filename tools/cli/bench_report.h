// SPDX-License-Identifier: MIT
// What `relume bench` found, as JSON and as the Markdown of docs/PERFORMANCE.md, beside the paper's figures.
#pragma once

#include "bake/budget/runtime_cost.h"
#include "tools/cli/bench_live.h"
#include "tools/cli/bench_measure.h"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace relume {

// The sizes of a bake that its times depend on.
struct BakeSizes {
  std::uint32_t surfels = 0, caches = 0, texels = 0, links = 0, linksPerCache = 0;  // linksPerCache: of the fullest row
  std::uint32_t lumaBands = 0, chromaBands = 0;
  std::string linkKind;
  RuntimeCost reckoned;  // of its recommended bands, on the reference processor
};
BakeSizes sizesOf(const Bake& bake);

struct BenchSetting {
  std::string name;  // "high", or the bake file's
  BakeSizes sizes;
  BakeTimes bake;  // no stages when the bake came from a file
  std::vector<RelightTimes> relight;
};

// A point of a scaling curve.
struct CurvePoint {
  BakeSizes sizes;
  BakeTimes bake;
  double relightMs = 0.0;  // median frame, CPU, 1 thread
};

struct BenchReport {
  std::string scene, date, command, version;
  Machine machine;
  std::string renderer;  // GL_RENDERER and version; why there is none otherwise; empty = not asked for
  int bakeThreads = 0;
  double importSeconds = 0.0;
  std::vector<BenchSetting> settings;
  std::vector<CurvePoint> surfelCurve, cacheCurve;
  std::optional<LiveFigures> live;  // in place of settings and curves
};

nlohmann::json toJson(const BenchReport& report);
std::string toMarkdown(const BenchReport& report);

}  // namespace relume
