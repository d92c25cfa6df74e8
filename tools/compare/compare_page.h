// SPDX-License-Identifier: MIT
// The report of `relume compare` as one self-contained page: inline styles, SVG and PNG, no script, nothing from the
// network; readable on a phone and where a CI forbids scripts.
#pragma once

#include "tools/compare/compare_report.h"

#include <nlohmann/json.hpp>

#include <string>

namespace relume {

// What `relume bake --report` wrote about the two bakes; null where there is none.
struct RunReports {
  nlohmann::json a, b;
};

// `light` is null when the files have the same bytes.
std::string reportAsPage(const nlohmann::json& report, const BakeFile& a, const BakeFile& b,
                         const LightDifference* light, const RunReports& runs);

}  // namespace relume
