// SPDX-License-Identifier: MIT
// What the accuracy suite measured, as Markdown.
#pragma once

#include "tests/accuracy/compare_images.h"
#include "tests/accuracy/levels.h"

#include <cstdint>
#include <string>
#include <vector>

namespace relume {

// One quantity of one reference.
struct AccuracyRow {
  std::string image, aov;
  ImageDifference difference;
  const AccuracyBound* bound = nullptr;
  bool passed = true;
};

struct AccuracyBake {
  std::string level;
  double seconds = 0.0, peakMiB = 0.0;
  std::uint64_t surfels = 0, caches = 0, links = 0, triangles = 0;
};

// All of a setting.
struct AccuracyTable {
  const AccuracySetting* setting = nullptr;
  std::vector<AccuracyBake> bakes;
  std::vector<AccuracyRow> rows;
};

std::string accuracyRows(const AccuracyTable& table);
std::string accuracyReport(const std::vector<AccuracyTable>& tables, const std::string& date);

}  // namespace relume
