// SPDX-License-Identifier: MIT
// `relume compare`: what differs between two bakes, in the order: what was baked, sizes, arrays, light, verdict. The
// JSON (docs/compare.schema.json) is the report; text and page are made of it.
#pragma once

#include "formats/chunks.h"
#include "relume/bake_data.h"
#include "tools/compare/compare_light.h"

#include <nlohmann/json.hpp>

#include <limits>
#include <string>
#include <vector>

namespace relume {

struct BakeFile {
  std::string name;  // as given on the command line
  Bake bake;
  std::vector<ChunkInfo> chunks;
};

struct CompareBounds {
  double maxRmse = std::numeric_limits<double>::infinity();            // [>= 0] of any counted lighting
  double maxCacheChange = std::numeric_limits<double>::infinity();     // [>= 0] of any counted cache
  double maxReceiverChange = std::numeric_limits<double>::infinity();  // [>= 0] of any node's receivers, or the air's
};

// The report of two files with the same bytes.
nlohmann::json reportSame(const std::string& a, const std::string& b, std::uint64_t bytes, const LightIgnore& ignore,
                          const CompareBounds& bounds);

// The report of two that differ.
nlohmann::json reportDifference(const BakeFile& a, const BakeFile& b, const LightDifference& light,
                                const LightIgnore& ignore, const CompareBounds& bounds);

// Whether the report's verdict is "exceeded".
bool boundExceeded(const nlohmann::json& report);

// For people.
std::string reportAsText(const nlohmann::json& report);

// Values of a report as the text and the page say them: what is not a string as JSON, what is not a number as 0.
std::string reportText(const nlohmann::json& value);
std::string lightingText(const nlohmann::json& lighting);  // its name, and what a renamed emitter was called
std::string lightingNote(const nlohmann::json& lighting);  // " (dark in A)", " (ignored)", " (not converged)", or none
double reportNumber(const nlohmann::json& value);
std::string reportPercent(const nlohmann::json& value);  // "4.20%"; "infinite" of a change beyond all bounds

}  // namespace relume
