// SPDX-License-Identifier: MIT
// See report.h.
#include "tests/accuracy/report.h"

#include <algorithm>
#include <cstdio>

namespace relume {
namespace {

template <class... Values>
std::string format(const char* pattern, Values... values) {
  char text[256];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

std::string percent(double share) { return format("%.1f", 100.0 * share); }

std::string boundText(const AccuracyBound* bound) {
  if (bound == nullptr) return "";
  std::string text;
  if (bound->rmseClean > 0) text += "rmse ≤ " + percent(bound->rmseClean);
  if (bound->rmseTrimmed > 0) text += std::string(text.empty() ? "" : ", ") + "t1 ≤ " + percent(bound->rmseTrimmed);
  if (bound->energy > 0) text += std::string(text.empty() ? "" : ", ") + "energy ± " + percent(bound->energy);
  return text;
}

std::string bakeRows(const AccuracyTable& table) {
  std::string text =
      "| level | `relume bake` | triangles | surfels | caches | links | seconds | peak MiB |\n"
      "| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: |\n";
  for (const AccuracyBake& bake : table.bakes) {
    std::string options;
    for (const AccuracyLevel& level : kAccuracyLevels) {
      if (bake.level != level.name) continue;
      for (const std::string& word : bakeOptionsOf(level, *table.setting))
        options += (options.empty() ? "" : " ") + word;
    }
    text += "| `" + bake.level + "` | `" + options + "` | " + std::to_string(bake.triangles) + " | " +
            std::to_string(bake.surfels) + " | " + std::to_string(bake.caches) + " | " + std::to_string(bake.links) +
            " | " + format("%.1f", bake.seconds) + " | " + format("%.0f", bake.peakMiB) + " |\n";
  }
  return text;
}

bool showsLevel(const std::vector<AccuracyTable>& tables, const char* level) {
  for (const AccuracyTable& table : tables) {
    for (const AccuracyBake& bake : table.bakes) {
      if (bake.level == level) return true;
    }
  }
  return false;
}

}  // namespace

std::string accuracyRows(const AccuracyTable& table) {
  std::string text =
      "| reference | quantity | rmse % | t1 % | energy | p95 % | noise % | bound % | |\n"
      "| --- | --- | ---: | ---: | ---: | ---: | ---: | --- | --- |\n";
  for (const AccuracyRow& row : table.rows) {
    const ImageDifference& d = row.difference;
    text += "| `" + row.image + "` | " + row.aov + " | " + percent(d.rmseClean) + " | " + percent(d.rmseTrimmed) +
            " | " + format("%.3f", d.energy) + " | " + percent(d.blockP95) + " | " + percent(d.noise) + " | " +
            boundText(row.bound) + " | " + (row.passed ? (row.bound ? "ok" : "") : "**above**") + " |\n";
  }
  return text;
}

std::string accuracyReport(const std::vector<AccuracyTable>& tables, const std::string& date) {
  std::string text =
      "# Accuracy\n\n"
      "Relume's light against path-traced references (Cycles; `two_rooms`: `relume reference --dynamic receivers`), "
      "made by `tests/accuracy`" +
      (date.empty() ? std::string() : " on " + date) +
      ".\n\n"
      "`rmse` is the relative root mean square error with the reference's own noise removed, `t1` the same without the "
      "worst 1 % of the pixels, `energy` the sum of light over the reference's, `p95` the 95th percentile of the "
      "relative error of 4 x 4 pixel blocks, `noise` what the reference itself is off by. `indirect` is reflected "
      "light "
      "(of emitters: all their light), `bounced` only what was reflected. Pixels at edges, of emitters and of nearly "
      "black surfaces do not count. Seconds and memory are those of the bakes, with reading the level, as they ran.\n";
  for (const AccuracyTable& table : tables) {
    text += std::string("\n## ") + table.setting->title + "\n\n" + accuracyRows(table) + "\n" + bakeRows(table);
  }
  bool first = true;
  for (const AccuracyNote& note : kAccuracyNotes) {
    if (!showsLevel(tables, note.level)) continue;
    if (first) text += "\n## Notes\n\n";
    first = false;
    text += std::string("- `") + note.level + "`: " + note.text + "\n";
  }
  return text;
}

}  // namespace relume
