// SPDX-License-Identifier: MIT
// See bench_report.h. The paper's figures are those of PIC Tables 2 and 4, with the sum of the links corrected
// (Erratum: 2689k links of 12 bytes are 30.77 MiB, not 30.08).
#include "tools/cli/bench_report.h"

#include "bake/base/printed.h"
#include "bake/base/read_json.h"
#include "tools/cli/bench_tables.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace relume {
namespace {

// A setting of PIC Table 2. [ms]
struct PaperSetting {
  const char* name;
  std::uint32_t surfels, caches, links, bands;
  struct Column {
    const char* machine;
    double surfels, pull, caches;
  };
  std::array<Column, 3> columns;
  double linkMiB, totalMiB;  // with run-time projection
};
constexpr std::array<PaperSetting, 2> kPaper = {{
    {"high",
     131072,
     10585,
     254,
     4,
     {{{"GTX 980", 0.09, 1.72, 2.27}, {"i7-4790S", 8.12, 5.00, 116}, {"i7-4510U", 7.06, 8.04, 148}}},
     30.77,
     42.8},
    {"moderate",
     32768,
     10585,
     128,
     3,
     {{{"GTX 980", 0.04, 0.38, 0.58}, {"i7-4790S", 4.87, 1.13, 11.5}, {"i7-4510U", 2.57, 1.34, 28.0}}},
     0.0,
     19.3},
}};

// The paper's setting that this one can stand beside, or null: same surfels, links and bands, caches within a quarter.
const PaperSetting* paperSettingOf(const BakeSizes& sizes) {
  for (const PaperSetting& paper : kPaper) {
    const double caches = static_cast<double>(sizes.caches) / paper.caches;
    if (sizes.surfels == paper.surfels && sizes.linksPerCache == paper.links && sizes.lumaBands == paper.bands &&
        caches > 0.75 && caches < 1.25) {
      return &paper;
    }
  }
  return nullptr;
}

std::string sizesText(const BakeSizes& s) {
  return printed("n_S %u, n_C %u, n_L up to %u (%u %slinks), l %u", s.surfels, s.caches, s.linksPerCache, s.links,
                 (s.linkKind.empty() ? "" : s.linkKind + " ").c_str(), s.lumaBands) +
         (s.chromaBands != s.lumaBands ? printed(" / %u", s.chromaBands) : "");
}

// The figures of a stage that say how well it did.
std::string remark(const StageReport& stage) {
  const auto figure = [&](const char* name) {
    for (const auto& [key, value] : stage.figures) {
      if (key == name) return value;
    }
    return 0.0;
  };
  if (stage.stage == "play space") return printed("%.0f %% of the area culled", 100.0 * figure("culled_share"));
  if (stage.stage == "surfels" && figure("spacing_densest_m") > 0.0) {
    return printed("least spacing %.3f D, CV %.3f, area error %.1e",
                   figure("spacing_min_m") / figure("spacing_densest_m"), figure("spacing_cv"), figure("area_error"));
  }
  if (stage.stage == "hierarchy") return printed("%.0f senders, depth %.0f", figure("senders"), figure("depth"));
  if (stage.stage == "caches") return printed("%.0f caches", figure("caches"));
  if (stage.stage == "links" && stage.seconds > 0.0) {
    return printed("%.1f M rays, %.1f Mray/s with all that is done to them", figure("rays") * 1e-6,
                   figure("rays") * 1e-6 / stage.seconds);
  }
  return "";
}

std::string bakeTable(const BenchReport& report, const BenchSetting& setting) {
  std::string text =
      printed("\n### Bake, %d threads\n\n", report.bakeThreads) + "| stage | seconds | |\n|---|---:|---|\n";
  text += tableRow({"import", tableNumber(report.importSeconds), ""});
  for (const StageReport& stage : setting.bake.stages)
    text += tableRow({stage.stage, tableNumber(stage.seconds), remark(stage)});
  text += tableRow({"**whole bake**", "**" + tableNumber(setting.bake.seconds) + "**", "without import"});
  return text + "\nPeak memory of the process: " + printed("%.0f MiB.\n", setting.bake.peakMiB);
}

std::string relightTable(const BenchSetting& setting, const PaperSetting* paper) {
  std::string text = "\n### Relight, ms a frame\n\nMedian (least) over the frames, lit with " +
                     setting.relight.front().bands + ".\n\n";
  std::vector<std::string> titles{"pass"};
  for (const RelightTimes& times : setting.relight) titles.push_back(times.how);
  if (paper) {
    for (const auto& column : paper->columns) titles.push_back(std::string("PIC: ") + column.machine);
  }
  text += tableHead(titles);
  // Ours copies what a cache has gathered to its texels at once; the paper's (5) is not in its tables.
  constexpr std::array<std::pair<const char*, const char*>, 4> kPasses = {{{"surfels", "(2) light the surfels"},
                                                                           {"pull", "(3) pull"},
                                                                           {"caches", "(4) light the caches, (5) copy"},
                                                                           {"frame", "**(2) to (5)**"}}};
  for (const auto& [pass, title] : kPasses) {
    std::vector<std::string> cells{title};
    for (const RelightTimes& times : setting.relight) {
      const PassFigures* found = findPass(times, pass);
      const bool any = found && found->medianMs > 0.0;
      cells.push_back(any ? tableNumber(found->medianMs) + " (" + tableNumber(found->minMs) + ")" : "–");
    }
    if (paper) {
      for (const auto& c : paper->columns) {
        const std::string p = pass;
        const double ms = p == "surfels" ? c.surfels : p == "pull" ? c.pull : p == "caches" ? c.caches : 0.0;
        cells.push_back(tableNumber(p == "frame" ? c.surfels + c.pull + c.caches : ms));
      }
    }
    text += tableRow(cells);
  }
  return text;
}

// What the budgets of `relume bake` reckon with, and how this machine compares: by the least frame of one thread, where
// it was lit with the bands that the bake recommends.
std::string reckonedText(const BenchSetting& setting) {
  const RuntimeCost& cost = setting.sizes.reckoned;
  std::string text = "\nBudgets (`--budget-mb`, `--budget-ms`) reckon with " +
                     printed("%.1f MiB and %.2f ms", cost.bytes / 1048576.0, cost.frameMs) + " on the reference, " +
                     kReferenceProcessor;
  const std::string bands =
      bandsName({static_cast<int>(setting.sizes.lumaBands), static_cast<int>(setting.sizes.chromaBands)});
  for (const RelightTimes& times : setting.relight) {
    const PassFigures* frame = findPass(times, "frame");
    if (times.threads != 1 || times.bands != bands || !frame || !(cost.frameMs > 0.0)) continue;
    return text + printed("; this machine takes %.2f times that.\n", frame->minMs / cost.frameMs);
  }
  return text + ".\n";
}

// The paper's buffers of PIC Table 4 that hold what one of ours holds. [MiB]
double paperMiB(const std::string& buffer) {
  if (buffer == "surfels") return 1.46;
  if (buffer == "hierarchy") return 8.30;
  if (buffer == "links") return 30.77;
  if (buffer == "caches") return 1.71;
  if (buffer == "index") return 0.06 + 0.51;
  return 0.0;
}

std::string memoryTable(const BenchSetting& setting, const PaperSetting* paper) {
  const auto backend = [&](const char* name) -> const RelightTimes* {
    for (const RelightTimes& times : setting.relight) {
      if (times.backend == name) return &times;
    }
    return nullptr;
  };
  const std::array<const RelightTimes*, 2> sides = {backend("cpu"), backend("gl")};
  std::vector<std::string> titles{"buffer"}, names;
  for (const RelightTimes* side : sides) {
    if (!side) continue;
    titles.push_back(side->backend == "cpu" ? "CPU" : "OpenGL");
    for (const auto& [name, bytes] : side->buffers) {
      if (bytes > 0 && std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    }
  }
  if (paper) titles.push_back("PIC Table 4");
  std::string text = "\n### Runtime memory, MiB\n\n" + tableHead(titles);
  std::array<std::size_t, 2> total{};
  const bool detailed = paper && paper->linkMiB > 0.0;
  for (const std::string& name : names) {
    std::vector<std::string> cells{name};
    for (std::size_t i = 0; i < sides.size(); ++i) {
      if (!sides[i]) continue;
      std::size_t held = 0;
      for (const auto& [buffer, bytes] : sides[i]->buffers) held += buffer == name ? bytes : 0;
      total[i] += held;
      cells.push_back(tableNumber(mebibytes(held)));
    }
    if (paper) cells.push_back(detailed && paperMiB(name) > 0.0 ? tableNumber(paperMiB(name)) : "–");
    text += tableRow(cells);
  }
  std::vector<std::string> cells{"**all**"};
  for (std::size_t i = 0; i < sides.size(); ++i) {
    if (sides[i]) cells.push_back("**" + tableNumber(mebibytes(total[i])) + "**");
  }
  if (paper) cells.push_back(tableNumber(paper->totalMiB));
  text += tableRow(cells);
  if (detailed) {
    text +=
        "\nThe paper's hierarchy includes its fluxes (here: radiosity), its index is buffers (6) and (9) of its Figure "
        "5.\n";
  }
  return text;
}

std::string settingSection(const BenchReport& report, const BenchSetting& setting) {
  const PaperSetting* paper = paperSettingOf(setting.sizes);
  std::string text = "\n## " + setting.name + (paper ? std::string(": PIC's ") + paper->name + " setting" : "") +
                     "\n\n" + sizesText(setting.sizes) + "; light map of " +
                     printed("%u texels.\n", setting.sizes.texels);
  if (!setting.bake.stages.empty()) text += bakeTable(report, setting);
  if (!setting.relight.empty())
    text += relightTable(setting, paper) + memoryTable(setting, paper) + reckonedText(setting);
  return text;
}

double secondsOf(const BakeTimes& times, const std::string& stage) {
  for (const StageReport& each : times.stages) {
    if (each.stage == stage) return each.seconds;
  }
  return 0.0;
}

// Times with n and how they grow: the factor a tenfold n would cost at the slope between first and last point.
std::string curveTable(const std::vector<CurvePoint>& points, const char* n, std::uint32_t BakeSizes::*size,
                       const std::vector<std::string>& stages) {
  std::vector<std::string> titles{n};
  for (const std::string& stage : stages) titles.push_back(stage + ", s");
  titles.insert(titles.end(), {"whole bake, s", "peak, MiB", "relight, ms"});
  std::string text = tableHead(titles);
  const auto values = [&](const CurvePoint& point) {
    std::vector<double> v;
    for (const std::string& stage : stages) v.push_back(secondsOf(point.bake, stage));
    v.insert(v.end(), {point.bake.seconds, point.bake.peakMiB, point.relightMs});
    return v;
  };
  for (const CurvePoint& point : points) {
    std::vector<std::string> cells{std::to_string(point.sizes.*size)};
    for (const double v : values(point)) cells.push_back(tableNumber(v));
    text += tableRow(cells);
  }
  if (points.size() < 2) return text;
  const CurvePoint &first = points.front(), &last = points.back();
  const double decades = std::log10(static_cast<double>(last.sizes.*size) / (first.sizes.*size));
  if (!(decades > 0.0)) return text;
  std::vector<std::string> cells{"**a tenfold costs**"};
  const std::vector<double> a = values(first), b = values(last);
  for (std::size_t i = 0; i < a.size(); ++i) {
    cells.push_back(a[i] > 0.0 && b[i] > 0.0 ? "x " + tableNumber(std::pow(b[i] / a[i], 1.0 / decades)) : "–");
  }
  return text + tableRow(cells);
}

}  // namespace

BakeSizes sizesOf(const Bake& bake) {
  using namespace nlohmann::literals;
  BakeSizes sizes;
  sizes.surfels = bake.surfels.count();
  sizes.caches = bake.caches.count();
  sizes.texels = bake.caches.lightmap.width * bake.caches.lightmap.height;
  sizes.links = bake.links.count();
  for (std::uint32_t c = 0; c < bake.links.cacheCount(); ++c) {
    sizes.linksPerCache = std::max(sizes.linksPerCache, bake.links.rowBegin[c + 1] - bake.links.rowBegin[c]);
  }
  sizes.lumaBands = bake.provenance.lumaBands;
  sizes.chromaBands = bake.provenance.chromaBands;
  sizes.reckoned = runtimeCost(bake);
  const auto kind = "/links/kind"_json_pointer;
  const Result<nlohmann::json> options = readJson(bake.provenance.optionsJson);
  if (options && options->contains(kind) && options->at(kind).is_string())
    sizes.linkKind = options->at(kind).get<std::string>();
  return sizes;
}

std::string toMarkdown(const BenchReport& report) {
  std::string text =
      "# Performance\n\nWritten by `relume bench`; `tests/bench/performance.sh SCENE` makes it anew.\n\n";
  text += "| | |\n|---|---|\n";
  text += tableRow({"machine", report.machine.processor + printed(", %u cores", report.machine.cores)});
  if (!report.renderer.empty()) text += tableRow({"OpenGL", report.renderer});
  text += tableRow({"scene", report.scene});
  text += tableRow({"command", "`" + report.command + "`"});
  text += tableRow({"version, date", report.version + ", " + report.date});
  if (report.live) return text + toMarkdown(*report.live);
  text +=
      "\nA frame is lit by one directional and one spot light without shadow maps, which are the host's; emission and "
      "bounces are on. The paper's times of (2) include its shadow maps' lookups.\n";
  for (const BenchSetting& setting : report.settings) text += settingSection(report, setting);
  if (!report.surfelCurve.empty()) {
    text +=
        "\n## With the number of surfels\n\nOther sizes are those of the preset `draft`; links are of the kind "
        "`cone`.\n\n" +
        curveTable(report.surfelCurve, "n_S", &BakeSizes::surfels, {"surfels", "hierarchy", "links"});
  }
  if (!report.cacheCurve.empty()) {
    text +=
        "\n## With the number of caches\n\nOther sizes are those of the preset `draft`; the grid has a fifth of the "
        "caches that are asked for.\n\n" +
        curveTable(report.cacheCurve, "n_C", &BakeSizes::caches, {"caches", "links"});
  }
  return text;
}

nlohmann::json toJson(const BenchReport& report) {
  using nlohmann::json;
  const auto sizes = [](const BakeSizes& s) {
    return json{{"surfels", s.surfels},
                {"caches", s.caches},
                {"lightmapTexels", s.texels},
                {"links", s.links},
                {"linksPerCache", s.linksPerCache},
                {"linkKind", s.linkKind},
                {"lumaBands", s.lumaBands},
                {"chromaBands", s.chromaBands}};
  };
  const auto bakeTimes = [](const BakeTimes& times) {
    json stages = json::array();
    for (const StageReport& stage : times.stages) {
      json figures = json::object();
      for (const auto& [name, value] : stage.figures) figures[name] = value;
      stages.push_back({{"stage", stage.stage}, {"seconds", stage.seconds}, {"figures", figures}});
    }
    return json{{"seconds", times.seconds}, {"peakMemoryMiB", times.peakMiB}, {"stages", stages}};
  };
  json settings = json::array();
  for (const BenchSetting& setting : report.settings) {
    json relight = json::array();
    for (const RelightTimes& times : setting.relight) relight.push_back(toJson(times));
    const RuntimeCost& cost = setting.sizes.reckoned;
    settings.push_back({{"name", setting.name},
                        {"sizes", sizes(setting.sizes)},
                        {"reckoned", {{"memoryMiB", cost.bytes / 1048576.0}, {"frameMs", cost.frameMs}}},
                        {"relight", relight}});
    if (!setting.bake.stages.empty()) settings.back()["bake"] = bakeTimes(setting.bake);
  }
  const auto curve = [&](const std::vector<CurvePoint>& points) {
    json list = json::array();
    for (const CurvePoint& p : points) {
      list.push_back({{"sizes", sizes(p.sizes)}, {"bake", bakeTimes(p.bake)}, {"relightMs", p.relightMs}});
    }
    return list;
  };
  json out = {{"scene", report.scene},
              {"date", report.date},
              {"version", report.version},
              {"processor", report.machine.processor},
              {"cores", report.machine.cores},
              {"renderer", report.renderer},
              {"bakeThreads", report.bakeThreads},
              {"importSeconds", report.importSeconds},
              {"settings", settings}};
  if (report.live) out["live"] = toJson(*report.live);
  if (!report.surfelCurve.empty()) out["surfelCurve"] = curve(report.surfelCurve);
  if (!report.cacheCurve.empty()) out["cacheCurve"] = curve(report.cacheCurve);
  return out;
}

}  // namespace relume
