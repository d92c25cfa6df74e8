// SPDX-License-Identifier: MIT
// See compare_page.h. One function a panel; every panel has an id, so that a test can find it.
#include "tools/compare/compare_page.h"

#include "bake/base/printed.h"
#include "tools/base/printable.h"
#include "tools/compare/compare_pictures.h"
#include "tools/images/image_io.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace relume {
namespace {

using Json = nlohmann::json;

const char* const kStyle = R"(
:root{--ink:#1d2329;--soft:#5d6770;--line:#d8dde2;--paper:#fff;--back:#f3f5f7;--bar:#3b6ea5;--bad:#b2182b;--good:#1a7f4b}
*{box-sizing:border-box}
body{margin:0;background:var(--back);color:var(--ink);font:15px/1.45 system-ui,sans-serif}
main{max-width:1100px;margin:0 auto;padding:12px}
section{background:var(--paper);border:1px solid var(--line);border-radius:8px;padding:12px 14px;margin:12px 0;overflow:hidden}
h1{font-size:20px;margin:14px 2px}h2{font-size:16px;margin:0 0 8px}h3{font-size:14px;margin:10px 0 4px;color:var(--soft)}
p{margin:6px 0}code{font-size:13px;overflow-wrap:anywhere}
.wide{overflow-x:auto}
table{border-collapse:collapse;width:100%;font-size:13px}
th,td{text-align:right;padding:3px 6px;border-bottom:1px solid var(--line);white-space:nowrap}
th:first-child,td:first-child{text-align:left;white-space:normal;min-width:7em;overflow-wrap:break-word}
th{color:var(--soft);font-weight:600}
.grid{display:grid;grid-template-columns:repeat(auto-fit,minmax(220px,1fr));gap:10px}
figure{margin:0}figcaption{color:var(--soft);font-size:13px}
img{width:100%;height:auto;display:block;image-rendering:pixelated;border:1px solid var(--line)}
.plan{position:relative;max-width:640px}.plan svg{position:absolute;inset:0;width:100%;height:100%}
svg{width:100%;height:auto;display:block}svg text{font-size:11px;fill:var(--soft)}
.bar{fill:var(--bar)}.axis{stroke:var(--soft);fill:none}
.marks circle{fill:#fffc;stroke:#111;stroke-width:1.5}.marks text{fill:#111}.marks .scale{stroke:#111;stroke-width:3}
.lead{text-align:left;line-height:1}.meter{display:inline-block;height:9px;background:var(--bar);border-radius:2px;vertical-align:middle;min-width:1px}
.meter.b{background:#d08a2e}
.bad{color:var(--bad)}.good{color:var(--good)}
summary{cursor:pointer;padding:4px 0;font-weight:600}
)";

// Control characters are named: what names hold does not reach the page as bytes that HTML forbids.
std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : printable(text)) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string textOf(const Json& value) { return escaped(reportText(value)); }

// A list of names, or of bounds, which are called what the table above them calls them.
std::string listText(const Json& names) {
  static const std::map<std::string, std::string> kBounds = {
      {"rmse", "relative RMSE of a lighting"},
      {"cacheChange", "relative change of a cache"},
      {"receiverChange", "relative change of what is read"},
      {"unmatchedCaches", "fewer than half of A's caches have a partner in B"},
      {"unmatchedParts", "fewer than half of A's parts can be compared with B's"}};
  std::string text;
  for (const Json& name : names) {
    const auto bound = kBounds.find(reportText(name));
    text += (text.empty() ? "" : ", ") + (bound != kBounds.end() ? bound->second : textOf(name));
  }
  return text;
}

std::string fixed(double value, int digits) { return printed("%.*f", digits, value); }

std::string percent(const Json& value) {
  const double share = reportNumber(value);
  return isBeyondBounds(share) ? "infinite" : fixed(100.0 * share, 2) + "&nbsp;%";
}

std::string certifiedText(const Json& error) { return error.is_null() ? "none" : percent(error); }

std::string kib(const Json& value) { return fixed(reportNumber(value) / 1024.0, 1); }

std::string row(std::initializer_list<std::string> cells, const char* tag = "td") {
  std::string text = "<tr>";
  for (const std::string& cell : cells) text += std::string("<") + tag + ">" + cell + "</" + tag + ">";
  return text + "</tr>";
}

std::string table(const std::string& rows) { return "<div class=\"wide\"><table>" + rows + "</table></div>"; }

std::string section(const char* id, const std::string& title, const std::string& body) {
  return "<section id=\"" + std::string(id) + "\"><h2>" + title + "</h2>" + body + "</section>\n";
}

// "3" when both agree, "3 &rarr; 4" when not.
std::string both(const Json& pair) {
  return pair["a"] == pair["b"] ? textOf(pair["a"]) : textOf(pair["a"]) + " &rarr; " + textOf(pair["b"]);
}

std::string meter(double share, const char* kind = "") {
  return "<div class=\"lead\"><span class=\"meter " + std::string(kind) +
         "\" style=\"width:" + fixed(std::clamp(share, 0.0, 1.0) * 110.0, 0) + "px\"></span></div>";
}

std::string dataUri(const RgbImage& image) {
  static const char* kAlphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const std::vector<std::byte> png = encodePng(image.width, image.height, image.rgb);
  std::string text = "data:image/png;base64,";
  for (std::size_t i = 0; i < png.size(); i += 3) {
    std::uint32_t v = 0;
    for (std::size_t k = 0; k < 3; ++k) v = v << 8 | (i + k < png.size() ? static_cast<std::uint32_t>(png[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += i + k <= png.size() ? kAlphabet[v >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

std::string figure(const RgbImage& image, const std::string& caption) {
  if (image.rgb.empty()) return "<figure><figcaption>" + caption + ": no light map</figcaption></figure>";
  return "<figure><img src=\"" + dataUri(image) + "\" width=\"" + std::to_string(image.width) + "\" height=\"" +
         std::to_string(image.height) + "\" alt=\"" + caption + "\"><figcaption>" + caption + "</figcaption></figure>";
}

std::string verdictPanel(const Json& report) {
  std::string body = "<p>A: <code>" + textOf(report["a"]["file"]) + "</code>, " + textOf(report["a"]["bytes"]) +
                     " bytes<br>B: <code>" + textOf(report["b"]["file"]) + "</code>, " + textOf(report["b"]["bytes"]) +
                     " bytes</p>";
  if (report["same"].get<bool>()) return section("verdict", "<span class=\"good\">Same bytes</span>", body);
  const Json &verdict = report["verdict"], &light = report["light"];
  const bool exceeded = verdict["verdict"] == "exceeded";
  const auto measure = [&](const std::string& name, const char* found, const char* bound) {
    return row({name, percent(light[found]), verdict[bound].is_null() ? "none" : percent(verdict[bound])});
  };
  body += table(row({"", "found", "bound"}, "th") +
                measure("greatest relative RMSE of a lighting over the caches", "maxRmse", "maxRmse") +
                measure("greatest relative change of a cache", "maxChange", "maxCacheChange") +
                measure("greatest relative change of what a node's surfaces, or the air, read", "maxReceiverChange",
                        "maxReceiverChange") +
                row({"greatest &Delta;E of a cache", fixed(reportNumber(light["maxDeltaE"]), 2), "none"}));
  if (!verdict["exceeded"].empty()) body += "<p>Exceeded: " + listText(verdict["exceeded"]) + "</p>";
  if (!verdict["ignored"].empty()) body += "<p>Ignored: " + listText(verdict["ignored"]) + "</p>";
  const char* title = exceeded                            ? "<span class=\"bad\">EXCEEDED</span>"
                      : verdict["verdict"] == "no bounds" ? "Different; no bounds given"
                                                          : "<span class=\"good\">WITHIN BOUNDS</span>";
  return section("verdict", title, body);
}

std::string bakedPanel(const Json& baked) {
  std::string rows = row({"", "A &rarr; B"}, "th");
  for (const char* name : {"toolVersion", "algorithmVersion", "formatVersion", "rayTracer"})
    rows += row({name, both(baked[name])});
  for (const Json& o : baked["options"]) rows += row({textOf(o["name"]), both(o)});
  std::string parts;
  for (const Json& part : baked["sceneParts"]) parts += "<li>" + textOf(part["text"]) + "</li>";
  if (baked["viewsChanged"].get<bool>()) parts += "<li>cameras or play volumes changed</li>";
  return section(
      "baked", "What was baked",
      table(rows) + "<h3>Scene</h3>" + (parts.empty() ? "<p>The same parts.</p>" : "<ul>" + parts + "</ul>"));
}

std::string sizesPanel(const Json& sizes) {
  double max = 1.0;
  for (const Json& s : sizes["arrays"]) max = std::max({max, reportNumber(s["a"]), reportNumber(s["b"])});
  std::string rows = row({"array", "A [KiB]", "B [KiB]", "", ""}, "th");
  for (const Json& s : sizes["arrays"]) {
    if (reportNumber(s["a"]) == 0.0 && reportNumber(s["b"]) == 0.0) continue;
    rows += row({"<code>" + textOf(s["array"]) + "</code>", kib(s["a"]), kib(s["b"]),
                 meter(reportNumber(s["a"]) / max) + meter(reportNumber(s["b"]) / max, "b"),
                 s["same"].get<bool>() ? "same" : "differs"});
  }
  return section("sizes", "Sizes: " + kib(sizes["a"]) + " &rarr; " + kib(sizes["b"]) + " KiB", table(rows));
}

std::string arraysPanel(const Json& arrays) {
  const Json &s = arrays["surfels"], &c = arrays["caches"], &l = arrays["links"];
  const std::string rows =
      row({"surfels", both(s["count"])}) +
      row({"at the same place / moved / elsewhere",
           textOf(s["same"]) + " / " + textOf(s["moved"]) + " / " + textOf(s["elsewhere"])}) +
      row({"cost of the clusters", fixed(reportNumber(arrays["clusterCost"]["a"]), 4) + " &rarr; " +
                                       fixed(reportNumber(arrays["clusterCost"]["b"]), 4)}) +
      row({"certified error",
           certifiedText(arrays["certifiedError"]["a"]) + " &rarr; " + certifiedText(arrays["certifiedError"]["b"])}) +
      row({"caches", both(c["count"])}) +
      row({"matched / only in A / only in B",
           textOf(c["matched"]) + " / " + textOf(c["onlyInA"]) + " / " + textOf(c["onlyInB"])}) +
      row({"matched within", fixed(reportNumber(c["surfaceToleranceM"]), 3) + " m (surface), " +
                                 fixed(reportNumber(c["gridToleranceM"]), 3) + " m (grid)"}) +
      row({"mean distance of moved caches", fixed(reportNumber(c["meanMoveM"]), 4) + " m"}) +
      row({"light map", both(c["lightmap"])}) + row({"grid", both(c["grid"])}) +
      row({"grid points without a cache", both(c["gridPointsWithoutCache"])}) + row({"links", both(l["count"])}) +
      row({"kind of links", both(l["kind"])}) +
      row({"mean transfer of a cache", fixed(reportNumber(l["transferPerCache"]["a"]["mean"]), 4) + " &rarr; " +
                                           fixed(reportNumber(l["transferPerCache"]["b"]["mean"]), 4)}) +
      row({"RMS difference of transfer", fixed(reportNumber(l["transferRmsDifference"]), 5)});
  return section("arrays", "Arrays", table(rows));
}

std::string lightPanel(const Json& light) {
  double max = 1e-9;
  for (const Json& l : light["lightings"]) {
    if (const double rmse = reportNumber(l["rmse"]); !isBeyondBounds(rmse)) max = std::max(max, rmse);
  }
  std::string rows =
      row({"lighting", "RMSE", "", "mean", "95&nbsp;%", "worst", "&Delta;E mean", "&Delta;E worst"}, "th");
  for (const Json& l : light["lightings"])
    rows += row({escaped(lightingText(l)) + lightingNote(l), percent(l["rmse"]), meter(reportNumber(l["rmse"]) / max),
                 percent(l["change"]["mean"]), percent(l["change"]["p95"]), percent(l["change"]["max"]),
                 fixed(reportNumber(l["deltaE"]["mean"]), 2), fixed(reportNumber(l["deltaE"]["max"]), 2)});
  std::string worst = row({"place [m]", "node", "lighting", "change", "&Delta;E"}, "th");
  int at = 0;
  for (const Json& w : light["worst"])
    worst += row({std::to_string(++at) + ": " + fixed(reportNumber(w["positionM"][0]), 2) + ", " +
                      fixed(reportNumber(w["positionM"][1]), 2) + ", " + fixed(reportNumber(w["positionM"][2]), 2),
                  textOf(w["node"]), textOf(w["lighting"]), percent(w["change"]), fixed(reportNumber(w["deltaE"]), 1)});
  std::string nodes = row({"node", "caches", "mean", "worst"}, "th");
  for (std::size_t i = 0; i < std::min<std::size_t>(12, light["nodes"].size()); ++i) {
    const Json& n = light["nodes"][i];
    nodes += row({n["node"] == "" ? "(caches of the grid)" : textOf(n["node"]), textOf(n["caches"]),
                  percent(n["meanChange"]), percent(n["maxChange"])});
  }
  return section("light", "What it means for light",
                 "<p>" + textOf(light["method"]) + ".</p>" + table(rows) + "<h3>Worst places</h3>" + table(worst) +
                     "<h3>By node</h3>" + table(nodes));
}

std::string receiversPanel(const Json& light) {
  const Json& r = light["receivers"];
  std::string rows = row({"lighting", "surfaces", "air"}, "th");
  for (const Json& l : light["lightings"])
    rows += row({escaped(lightingText(l)) + lightingNote(l), percent(l["receivers"]["surfaces"]),
                 percent(l["receivers"]["air"])});
  std::string groups = row({"node", "lighting", "receivers", "change"}, "th");
  for (std::size_t i = 0; i < std::min<std::size_t>(20, r["groups"].size()); ++i) {
    const Json& g = r["groups"][i];
    groups += row({g["air"].get<bool>() ? "(the air)" : textOf(g["group"]), textOf(g["lighting"]),
                   textOf(g["receivers"]), percent(g["change"])});
  }
  const std::string surfaces = r["surfaces"] == 0 ? "No points on surfaces"
                                                  : textOf(r["surfaces"]) + " points on the surfaces of " +
                                                        textOf(r["partsCompared"]) + " parts";
  return section("receivers", "What receivers read",
                 "<p>" + surfaces + ", through each bake's own light map and grid, and " + textOf(r["air"]) +
                     " readings in the air. Not compared: " + textOf(r["partsOnlyInA"]) + " parts only in A, " +
                     textOf(r["partsOnlyInB"]) + " only in B, " + textOf(r["partsReshaped"]) + " reshaped.</p>" +
                     (r["lightMapLeftOut"].get<bool>()
                          ? "<p class=\"bad\">Surfaces on the light map are not compared: a bake lacks its coordinates "
                            "(<code>relume pack --profile web</code>); compare one packed with "
                            "<code>--keep-coordinates</code>.</p>"
                          : "") +
                     table(rows) + "<h3>By node, under its worst lighting</h3>" + table(groups));
}

std::string mapsPanel(const BakeFile& a, const BakeFile& b, const LightDifference& light, double scale) {
  std::vector<const LightingDifference*> order;  // the worst first, and open
  for (const LightingDifference& l : light.lightings) order.push_back(&l);
  std::stable_sort(order.begin(), order.end(), [](const auto* x, const auto* y) { return x->rmse > y->rmse; });
  std::string body =
      "<p>A and B: luminance of irradiance, bright = the lighting's 95th percentile. Difference: blue = less, "
      "red = more light, full colour at &plusmn;" +
      fixed(100.0 * scale, 0) + "&nbsp;%; yellow = no cache of A stands there. Grey = no cache.</p>";
  for (const LightingDifference* l : order)
    body += "<details" + std::string(l == order.front() ? " open" : "") + "><summary>" +
            escaped(l->name + (l->was.empty() ? "" : ", was " + l->was)) + ", RMSE " + percent(l->rmse) +
            "</summary><div class=\"grid\">" + figure(drawLightmap(a.bake, l->irradianceA, l->white), "A") +
            figure(drawLightmap(b.bake, l->irradianceB, l->white), "B") +
            figure(drawLightmapDifference(b.bake, light, *l, scale), "difference") + "</div></details>";
  return section("maps", "Light maps", body);
}

std::string planPanel(const BakeFile& a, const LightDifference& light, double scale) {
  const PlanView plan = drawPlan(a.bake, light, scale);
  if (plan.image.rgb.empty()) return section("plan", "Where light changed", "<p>No caches match.</p>");
  return section(
      "plan", "Where light changed",
      "<p>From above, x to the right, z down: the greatest change of the caches at each place over all lightings, "
      "red = " +
          fixed(100.0 * scale, 0) + "&nbsp;% or more. Numbers: worst places.</p><div class=\"plan\"><img src=\"" +
          dataUri(plan.image) + "\" width=\"" + std::to_string(plan.image.width) + "\" height=\"" +
          std::to_string(plan.image.height) + "\" alt=\"plan view of changes\">" + planMarksSvg(plan, light) +
          "</div>");
}

std::string histogramPanel(const LightDifference& light) {
  std::vector<float> changes, deltas;
  for (const LightingDifference& l : light.lightings) {
    if (!l.counted) continue;
    for (std::size_t i = 0; i < l.change.size(); ++i) {
      if (light.greatestChange[i] < 0.0f) continue;
      changes.push_back(l.change[i]);
      deltas.push_back(l.deltaE[i]);
    }
  }
  return section(
      "histograms", "Histograms over caches and lightings",
      "<div class=\"grid\"><figure>" + histogramSvg(changes, true, 0.0, "relative change") + "</figure><figure>" +
          histogramSvg(deltas, false, 12.0, "CIE 1976 difference (last bin: 12 and more)") + "</figure></div>");
}

std::string stagesPanel(const RunReports& runs) {
  if (!runs.a.is_object() && !runs.b.is_object())
    return section("stages", "Stage times", "<p>No reports of the bakes were given (--report-a, --report-b).</p>");
  std::vector<std::string> order;
  std::map<std::string, std::pair<double, double>> seconds;
  double max = 1e-9;
  for (const bool second : {false, true}) {
    const Json& run = second ? runs.b : runs.a;
    if (!run.is_object() || !run.contains("stages") || !run["stages"].is_array()) continue;
    for (const Json& stage : run["stages"]) {
      if (!stage.is_object() || !stage.contains("stage") || !stage["stage"].is_string() || !stage.contains("seconds"))
        continue;
      const std::string name = stage["stage"].get<std::string>();
      if (!seconds.contains(name)) order.push_back(name);
      double& value = second ? seconds[name].second : seconds[name].first;
      value = std::max(value, reportNumber(stage["seconds"]));
      max = std::max(max, value);
    }
  }
  std::string rows = row({"stage", "A [s]", "B [s]", ""}, "th");
  for (const std::string& name : order) {
    const auto [a, b] = seconds[name];
    rows += row({escaped(name), fixed(a, 3), fixed(b, 3), meter(a / max) + meter(b / max, "b")});
  }
  return section("stages", "Stage times", table(rows));
}

}  // namespace

std::string reportAsPage(const Json& report, const BakeFile& a, const BakeFile& b, const LightDifference* light,
                         const RunReports& runs) {
  std::string page =
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">"
      "<title>relume compare</title><link rel=\"icon\" href=\"data:,\"><style>" +
      std::string(kStyle) + "</style></head><body><main><h1>relume compare</h1>\n";
  page += verdictPanel(report);
  if (light != nullptr) {
    const double scale = pictureScale(*light);
    page += planPanel(a, *light, scale) + mapsPanel(a, b, *light, scale) + histogramPanel(*light) +
            receiversPanel(report["light"]) + lightPanel(report["light"]) + bakedPanel(report["baked"]) +
            sizesPanel(report["sizes"]) + arraysPanel(report["arrays"]);
  }
  page += stagesPanel(runs);
  return page + "</main></body></html>\n";
}

}  // namespace relume
