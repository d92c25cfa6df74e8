// SPDX-License-Identifier: MIT
// See bench_tables.h.
#include "tools/cli/bench_tables.h"

#include "bake/base/printed.h"

namespace relume {

std::string tableNumber(double value) {
  if (value == 0.0) return "–";
  if (value >= 100.0) return printed("%.0f", value);
  return printed(value >= 10.0 ? "%.1f" : (value >= 1.0 ? "%.2f" : "%.3f"), value);
}

double mebibytes(std::size_t bytes) { return static_cast<double>(bytes) / (1024.0 * 1024.0); }

std::string tableRow(const std::vector<std::string>& cells) {
  std::string text = "|";
  for (const std::string& cell : cells) text += " " + cell + " |";
  return text + "\n";
}

std::string tableHead(const std::vector<std::string>& cells) {
  std::string text = tableRow(cells) + "|---|";
  for (std::size_t i = 1; i < cells.size(); ++i) text += "---:|";
  return text + "\n";
}

const PassFigures* findPass(const RelightTimes& times, const std::string& pass) {
  for (const PassFigures& each : times.passes) {
    if (each.pass == pass) return &each;
  }
  return nullptr;
}

nlohmann::json toJson(const RelightTimes& times) {
  nlohmann::json passes = nlohmann::json::object(), buffers = nlohmann::json::object();
  for (const PassFigures& p : times.passes) passes[p.pass] = {{"medianMs", p.medianMs}, {"minMs", p.minMs}};
  for (const auto& [name, bytes] : times.buffers) buffers[name] = bytes;
  nlohmann::json json{{"backend", times.backend}, {"bands", times.bands}, {"passes", passes}, {"bufferBytes", buffers}};
  if (times.threads > 0) json["threads"] = times.threads;
  return json;
}

}  // namespace relume
