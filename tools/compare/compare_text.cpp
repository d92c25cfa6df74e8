// SPDX-License-Identifier: MIT
// The report of `relume compare` for people: the JSON, in its order, as lines.
#include "bake/base/printed.h"
#include "tools/compare/compare_report.h"

#include "tools/base/printable.h"

#include <algorithm>
#include <cstdarg>

namespace relume {
namespace {

using Json = nlohmann::json;

__attribute__((format(printf, 2, 3))) void line(std::string& text, const char* format, ...) {
  std::va_list arguments;
  va_start(arguments, format);
  text += vprinted(format, arguments) + '\n';
  va_end(arguments);
}

// "name: 3" when both agree, "name: 3 -> 4" when not.
void both(std::string& text, const char* name, const Json& pair) {
  const std::string a = reportText(pair["a"]), b = reportText(pair["b"]);
  line(text, "  %-22s %s", name, (a == b ? a : a + " -> " + b).c_str());
}

void printBaked(std::string& text, const Json& baked) {
  line(text, "What was baked: %s", baked["sameScene"].get<bool>() ? "the same scene" : "another scene");
  for (const char* name : {"toolVersion", "algorithmVersion", "formatVersion", "rayTracer"})
    both(text, name, baked[name]);
  for (const Json& o : baked["options"])
    line(text, "  option %-15s %s -> %s", reportText(o["name"]).c_str(), reportText(o["a"]).c_str(),
         reportText(o["b"]).c_str());
  constexpr std::size_t kMaxNamed = 20;
  const Json& parts = baked["sceneParts"];
  for (std::size_t i = 0; i < std::min(kMaxNamed, parts.size()); ++i)
    line(text, "  %s", reportText(parts[i]["text"]).c_str());
  if (parts.size() > kMaxNamed) line(text, "  and %zu more changes (--json lists all)", parts.size() - kMaxNamed);
  if (baked["viewsChanged"].get<bool>()) line(text, "  cameras or play volumes changed");
}

void printSizes(std::string& text, const Json& sizes) {
  line(text, "Sizes: %.0f -> %.0f bytes", reportNumber(sizes["a"]), reportNumber(sizes["b"]));
  for (const Json& s : sizes["arrays"]) {
    if (s["same"].get<bool>()) continue;
    line(text, "  %-16s %12.0f -> %12.0f%s", reportText(s["array"]).c_str(), reportNumber(s["a"]), reportNumber(s["b"]),
         s["a"] == s["b"] ? "  other values" : "");
  }
}

void printArrays(std::string& text, const Json& arrays) {
  const Json &surfels = arrays["surfels"], &caches = arrays["caches"], &links = arrays["links"];
  line(text, "Arrays:");
  both(text, "surfels", surfels["count"]);
  line(text, "  %-22s %s same, %s moved by %.4f m on average, %s elsewhere", "", reportText(surfels["same"]).c_str(),
       reportText(surfels["moved"]).c_str(), reportNumber(surfels["meanMoveM"]),
       reportText(surfels["elsewhere"]).c_str());
  line(text, "  %-22s %.4f -> %.4f", "cluster cost", reportNumber(arrays["clusterCost"]["a"]),
       reportNumber(arrays["clusterCost"]["b"]));
  const auto certified = [&](const char* which) {
    const Json& error = arrays["certifiedError"][which];
    return error.is_null() ? std::string("none") : printed("%.1f %%", 100 * reportNumber(error));
  };
  line(text, "  %-22s %s -> %s", "certified error", certified("a").c_str(), certified("b").c_str());
  both(text, "caches", caches["count"]);
  line(text, "  %-22s %s matched, %s moved (mean %.4f m, most %.4f m), %s only in A, %s only in B", "",
       reportText(caches["matched"]).c_str(), reportText(caches["moved"]).c_str(), reportNumber(caches["meanMoveM"]),
       reportNumber(caches["maxMoveM"]), reportText(caches["onlyInA"]).c_str(), reportText(caches["onlyInB"]).c_str());
  both(text, "light map", caches["lightmap"]);
  both(text, "grid", caches["grid"]);
  both(text, "grid points unused", caches["gridPointsWithoutCache"]);
  both(text, "texels unused", caches["texelsWithoutCache"]);
  both(text, "links", links["count"]);
  both(text, "kind of links", links["kind"]);
  const Json& t = links["transferPerCache"];
  line(text, "  %-22s mean %.4f -> %.4f, rms difference %.4f, most %.4f", "transfer per cache",
       reportNumber(t["a"]["mean"]), reportNumber(t["b"]["mean"]), reportNumber(links["transferRmsDifference"]),
       reportNumber(links["transferMaxDifference"]));
}

void printLight(std::string& text, const Json& light) {
  line(text, "Light (%s):", reportText(light["method"]).c_str());
  line(text, "  %-28s %9s %9s %9s %9s %9s %9s", "lighting", "rmse", "mean", "95 %", "worst", "dE mean", "dE worst");
  for (const Json& l : light["lightings"]) {
    const Json &c = l["change"], &e = l["deltaE"];
    line(text, "  %-28s %9s %9s %9s %9s %9.2f %9.2f%s", lightingText(l).c_str(), reportPercent(l["rmse"]).c_str(),
         reportPercent(c["mean"]).c_str(), reportPercent(c["p95"]).c_str(), reportPercent(c["max"]).c_str(),
         reportNumber(e["mean"]), reportNumber(e["max"]), lightingNote(l).c_str());
  }
  if (!light["worst"].empty()) line(text, "Worst places:");
  for (const Json& w : light["worst"]) {
    const Json& p = w["positionM"];
    line(text, "  (%.3f, %.3f, %.3f) node \"%s\", %s: %.1f %%, dE %.1f", reportNumber(p[0]), reportNumber(p[1]),
         reportNumber(p[2]), reportText(w["node"]).c_str(), reportText(w["lighting"]).c_str(),
         100 * reportNumber(w["change"]), reportNumber(w["deltaE"]));
  }
}

void printReceivers(std::string& text, const Json& light) {
  const Json& r = light["receivers"];
  const std::string surfaces =
      r["surfaces"] == 0 ? "none on surfaces"
                         : reportText(r["surfaces"]) + " on surfaces of " + reportText(r["partsCompared"]) + " parts";
  line(text, "Receivers: %s, %s in the air; parts only in A %s, only in B %s, reshaped %s", surfaces.c_str(),
       reportText(r["air"]).c_str(), reportText(r["partsOnlyInA"]).c_str(), reportText(r["partsOnlyInB"]).c_str(),
       reportText(r["partsReshaped"]).c_str());
  if (r["lightMapLeftOut"].get<bool>())
    line(text,
         "  surfaces on the light map are not compared: a bake lacks its coordinates (relume pack --profile web); "
         "compare one packed with --keep-coordinates");
  line(text, "  %-28s %9s %9s", "lighting", "surfaces", "air");
  for (const Json& l : light["lightings"])
    line(text, "  %-28s %9s %9s%s", lightingText(l).c_str(), reportPercent(l["receivers"]["surfaces"]).c_str(),
         reportPercent(l["receivers"]["air"]).c_str(), lightingNote(l).c_str());
  constexpr std::size_t kShown = 10;
  for (std::size_t i = 0; i < std::min(kShown, r["groups"].size()); ++i) {
    const Json& g = r["groups"][i];
    const std::string name = reportText(g["group"]);
    line(text, "  %s, %s: %.1f %% over %s receivers",
         g["air"].get<bool>() ? name.c_str() : ("node \"" + name + "\"").c_str(), reportText(g["lighting"]).c_str(),
         100 * reportNumber(g["change"]), reportText(g["receivers"]).c_str());
  }
}

void printVerdict(std::string& text, const Json& light, const Json& verdict) {
  const bool exceeded = verdict["verdict"] == "exceeded";
  line(text, "Verdict: %s",
       exceeded                            ? "EXCEEDED"
       : verdict["verdict"] == "no bounds" ? "no bounds given"
                                           : "WITHIN BOUNDS");
  const auto measure = [&](const char* name, const char* found, const char* bound, const char* key) {
    const Json& limit = verdict[bound];
    const std::string limitText = limit.is_number() ? printed("%g", reportNumber(limit)) : "none";
    const auto& list = verdict["exceeded"];
    const double value = reportNumber(light[found]);
    const std::string valueText = isBeyondBounds(value) ? "infinite" : printed("%.5f", value);
    line(text, "  %-28s %s, bound %s%s", name, valueText.c_str(), limitText.c_str(),
         std::find(list.begin(), list.end(), key) != list.end() ? ": EXCEEDED" : "");
  };
  measure("rmse over the caches", "maxRmse", "maxRmse", "rmse");
  measure("worst cache", "maxChange", "maxCacheChange", "cacheChange");
  measure("worst node's receivers", "maxReceiverChange", "maxReceiverChange", "receiverChange");
  for (const Json& name : verdict["exceeded"]) {
    if (name == "unmatchedCaches") line(text, "  fewer than half of A's caches have a partner in B: EXCEEDED");
    if (name == "unmatchedParts") line(text, "  fewer than half of A's parts can be compared with B's: EXCEEDED");
  }
}

}  // namespace

std::string reportText(const Json& value) {
  return value.is_string() ? value.get<std::string>() : value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string lightingText(const Json& lighting) {
  const std::string name = reportText(lighting["name"]);
  return lighting.contains("was") ? name + ", was " + reportText(lighting["was"]) : name;
}

std::string lightingNote(const Json& lighting) {
  const bool dark = isBeyondBounds(reportNumber(lighting["rmse"])) && reportNumber(lighting["meanA"]) == 0.0;
  return std::string(dark ? " (dark in A)" : "") + (lighting["counted"].get<bool>() ? "" : " (ignored)") +
         (lighting["converged"].get<bool>() ? "" : " (not converged)");
}

double reportNumber(const Json& value) { return value.is_number() ? value.get<double>() : 0.0; }

std::string reportPercent(const Json& value) {
  const double share = reportNumber(value);
  return isBeyondBounds(share) ? "infinite" : printed("%.2f%%", 100 * share);
}

std::string reportAsText(const Json& all) {
  const Json report = printableStrings(all);
  std::string text;
  line(text, "A: %s", reportText(report["a"]["file"]).c_str());
  line(text, "B: %s", reportText(report["b"]["file"]).c_str());
  if (report["same"].get<bool>()) {
    line(text, "same bytes");
    return text;
  }
  printBaked(text, report["baked"]);
  printSizes(text, report["sizes"]);
  printArrays(text, report["arrays"]);
  printLight(text, report["light"]);
  printReceivers(text, report["light"]);
  printVerdict(text, report["light"], report["verdict"]);
  return text;
}

}  // namespace relume
