// SPDX-License-Identifier: MIT
// The report of `relume compare` for people: the JSON, in its order, as lines.
#include "bake/printed.h"
#include "bake/tools/compare_report.h"

#include "bake/tools/printable.h"

#include <cstdarg>

namespace relume {
namespace {

using Json = nlohmann::json;

std::string textOf(const Json& value) {
  return value.is_string() ? value.get<std::string>() : value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

__attribute__((format(printf, 2, 3))) void line(std::string& text, const char* format, ...) {
  std::va_list arguments;
  va_start(arguments, format);
  text += vprinted(format, arguments) + '\n';
  va_end(arguments);
}

double number(const Json& value) { return value.is_number() ? value.get<double>() : 0.0; }

// "name: 3" when both agree, "name: 3 -> 4" when not.
void both(std::string& text, const char* name, const Json& pair) {
  const std::string a = textOf(pair["a"]), b = textOf(pair["b"]);
  line(text, "  %-22s %s", name, (a == b ? a : a + " -> " + b).c_str());
}

void printBaked(std::string& text, const Json& baked) {
  line(text, "What was baked: %s", baked["sameScene"].get<bool>() ? "the same scene" : "another scene");
  for (const char* name : {"toolVersion", "algorithmVersion", "formatVersion", "rayTracer"})
    both(text, name, baked[name]);
  for (const Json& o : baked["options"])
    line(text, "  option %-15s %s -> %s", textOf(o["name"]).c_str(), textOf(o["a"]).c_str(), textOf(o["b"]).c_str());
  for (const Json& part : baked["sceneParts"]) line(text, "  %s", textOf(part["text"]).c_str());
  if (baked["viewsChanged"].get<bool>()) line(text, "  cameras or play volumes changed");
}

void printSizes(std::string& text, const Json& sizes) {
  line(text, "Sizes: %.0f -> %.0f bytes", number(sizes["a"]), number(sizes["b"]));
  for (const Json& s : sizes["arrays"]) {
    if (s["same"].get<bool>()) continue;
    line(text, "  %-16s %12.0f -> %12.0f%s", textOf(s["array"]).c_str(), number(s["a"]), number(s["b"]),
         s["a"] == s["b"] ? "  other values" : "");
  }
}

void printArrays(std::string& text, const Json& arrays) {
  const Json &surfels = arrays["surfels"], &caches = arrays["caches"], &links = arrays["links"];
  line(text, "Arrays:");
  both(text, "surfels", surfels["count"]);
  line(text, "  %-22s %s same, %s moved by %.4f m on average, %s elsewhere", "", textOf(surfels["same"]).c_str(),
       textOf(surfels["moved"]).c_str(), number(surfels["meanMoveM"]), textOf(surfels["elsewhere"]).c_str());
  line(text, "  %-22s %.4f -> %.4f", "cluster cost", number(arrays["clusterCost"]["a"]),
       number(arrays["clusterCost"]["b"]));
  both(text, "caches", caches["count"]);
  line(text, "  %-22s %s matched, %s moved (mean %.4f m, most %.4f m), %s only in A, %s only in B", "",
       textOf(caches["matched"]).c_str(), textOf(caches["moved"]).c_str(), number(caches["meanMoveM"]),
       number(caches["maxMoveM"]), textOf(caches["onlyInA"]).c_str(), textOf(caches["onlyInB"]).c_str());
  both(text, "light map", caches["lightmap"]);
  both(text, "grid", caches["grid"]);
  both(text, "grid points unused", caches["gridPointsWithoutCache"]);
  both(text, "texels unused", caches["texelsWithoutCache"]);
  both(text, "links", links["count"]);
  both(text, "kind of links", links["kind"]);
  const Json& t = links["transferPerCache"];
  line(text, "  %-22s mean %.4f -> %.4f, rms difference %.4f, most %.4f", "transfer per cache", number(t["a"]["mean"]),
       number(t["b"]["mean"]), number(links["transferRmsDifference"]), number(links["transferMaxDifference"]));
}

void printLight(std::string& text, const Json& light) {
  line(text, "Light (%s):", textOf(light["method"]).c_str());
  line(text, "  %-28s %9s %9s %9s %9s %9s %9s", "lighting", "rmse", "mean", "95 %", "worst", "dE mean", "dE worst");
  for (const Json& l : light["lightings"]) {
    const Json &c = l["change"], &e = l["deltaE"];
    line(text, "  %-28s %8.2f%% %8.2f%% %8.2f%% %8.2f%% %9.2f %9.2f%s", textOf(l["name"]).c_str(),
         100 * number(l["rmse"]), 100 * number(c["mean"]), 100 * number(c["p95"]), 100 * number(c["max"]),
         number(e["mean"]), number(e["max"]), l["counted"].get<bool>() ? "" : "  (ignored)");
  }
  if (!light["worst"].empty()) line(text, "Worst places:");
  for (const Json& w : light["worst"]) {
    const Json& p = w["positionM"];
    line(text, "  (%.3f, %.3f, %.3f) node \"%s\", %s: %.1f %%, dE %.1f", number(p[0]), number(p[1]), number(p[2]),
         textOf(w["node"]).c_str(), textOf(w["lighting"]).c_str(), 100 * number(w["change"]), number(w["deltaE"]));
  }
}

void printVerdict(std::string& text, const Json& light, const Json& verdict) {
  const auto bound = [](const Json& value) { return value.is_number() ? printed("%g", number(value)) : "none"; };
  line(text, "Verdict: rmse %.5f (bound %s), worst cache %.5f (bound %s): %s", number(light["maxRmse"]),
       bound(verdict["maxRmse"]).c_str(), number(light["maxChange"]), bound(verdict["maxCacheChange"]).c_str(),
       verdict["passed"].empty() ? "no bound passed" : "BOUND PASSED");
  for (const Json& name : verdict["passed"]) {
    if (name == "unmatched") line(text, "  fewer than half of A's caches have a partner in B");
  }
}

}  // namespace

std::string reportAsText(const Json& all) {
  const Json report = printableStrings(all);
  std::string text;
  line(text, "A: %s", textOf(report["a"]["file"]).c_str());
  line(text, "B: %s", textOf(report["b"]["file"]).c_str());
  if (report["same"].get<bool>()) {
    line(text, "same bytes");
    return text;
  }
  printBaked(text, report["baked"]);
  printSizes(text, report["sizes"]);
  printArrays(text, report["arrays"]);
  printLight(text, report["light"]);
  printVerdict(text, report["light"], report["verdict"]);
  return text;
}

}  // namespace relume
