// SPDX-License-Identifier: MIT
// What the pages and the JSON of `relume bench` are put together from.
#pragma once

#include "tools/cli/bench_measure.h"

#include <nlohmann/json.hpp>

#include <cstddef>
#include <string>
#include <vector>

namespace relume {

// Three significant digits, as a table wants them; a dash for nothing.
std::string tableNumber(double value);
double mebibytes(std::size_t bytes);

// Rows of a Markdown table. tableHead(): the first column is text, the others are numbers.
std::string tableRow(const std::vector<std::string>& cells);
std::string tableHead(const std::vector<std::string>& cells);

// Null where there is no such pass.
const PassFigures* findPass(const RelightTimes& times, const std::string& pass);

nlohmann::json toJson(const RelightTimes& times);

}  // namespace relume
