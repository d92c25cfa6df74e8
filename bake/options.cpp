// SPDX-License-Identifier: MIT
// Presets, checks and JSON of the bake's options, over the table of option_table.h.
#include "relume/bake/options.h"

#include "bake/base/read_json.h"
#include "bake/option_table.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <new>
#include <optional>
#include <set>
#include <string_view>
#include <type_traits>
#include <variant>

namespace relume {
namespace {

using Json = nlohmann::json;  // keys are kept sorted: the text is canonical

// The shortest decimal that gives the float back: 0.1, not 0.10000000149.
double shortest(float value) {
  char text[64];
  const auto end = std::to_chars(text, text + sizeof(text), value).ptr;
  double result = 0.0;
  std::from_chars(text, end, result);
  return result;
}

std::string number(double value) {
  if (value == std::floor(value) && std::abs(value) < 1e15) return std::to_string(static_cast<long long>(value));
  char text[64];
  return std::string(text, std::to_chars(text, text + sizeof(text), value).ptr);
}

std::string join(const std::vector<const char*>& names) {
  std::string text;
  for (const char* name : names) {
    if (name != names.front()) text += '|';
    text += *name != 0 ? name : "\"\"";
  }
  return text;
}

std::string rangeText(const Field& field) {
  if (!field.names.empty()) return join(field.names);
  if (std::holds_alternative<bool*>(field.target)) return "true|false";
  if (std::holds_alternative<std::uint64_t*>(field.target)) return "0..2^64-1";
  return number(field.low) + ".." + number(field.high) +
         (std::holds_alternative<glm::uvec3*>(field.target) ? " each" : "");
}

Json toJson(const Field& field) {
  struct Visit {
    const Field& field;
    Json operator()(const bool* v) const { return *v; }
    Json operator()(const std::uint32_t* v) const { return *v; }
    Json operator()(const std::uint64_t* v) const { return *v; }
    Json operator()(const float* v) const { return shortest(*v); }
    Json operator()(const glm::uvec3* v) const { return Json::array({v->x, v->y, v->z}); }
    Json operator()(const std::string* v) const { return *v; }
    Json operator()(const Choice& v) const {
      const auto index = static_cast<std::size_t>(v.get(v.target));
      return index < field.names.size() ? Json(field.names[index]) : Json(index);
    }
  };
  return std::visit(Visit{field}, field.target);
}

Error wrongType(const Field& field, const char* expected, const Json& found) {
  return {ErrorCode::usage, std::string("option ") + field.name +
                                (*field.flag ? std::string(" (") + field.flag + ")" : "") + ": expected " + expected +
                                ", found " + found.dump(-1, ' ', false, Json::error_handler_t::replace).substr(0, 80)};
}

template <class Integer>
bool takeUnsigned(const Json& json, Integer& value) {
  if (json.is_number_unsigned()) {
    const auto wide = json.get<std::uint64_t>();
    if (wide > std::numeric_limits<Integer>::max()) return false;
    value = static_cast<Integer>(wide);
    return true;
  }
  // 1e6 is read as a floating-point number; take it when it is whole.
  if (!json.is_number_float()) return false;
  const double real = json.get<double>();
  if (!(real >= 0.0 && real <= 4294967295.0 && real == std::floor(real))) return false;
  value = static_cast<Integer>(real);
  return true;
}

Status fromJson(const Field& field, const Json& json) {
  struct Visit {
    const Field& field;
    const Json& json;
    Status operator()(bool* v) const {
      if (!json.is_boolean()) return wrongType(field, "true or false", json);
      *v = json.get<bool>();
      return done();
    }
    Status operator()(std::uint32_t* v) const {
      if (!takeUnsigned(json, *v)) return wrongType(field, ("a whole number, " + rangeText(field)).c_str(), json);
      return done();
    }
    Status operator()(std::uint64_t* v) const {
      if (!takeUnsigned(json, *v)) return wrongType(field, ("a whole number, " + rangeText(field)).c_str(), json);
      return done();
    }
    Status operator()(float* v) const {
      if (!json.is_number()) return wrongType(field, ("a number, " + rangeText(field)).c_str(), json);
      *v = static_cast<float>(json.get<double>());
      return done();
    }
    Status operator()(glm::uvec3* v) const {
      const bool three = json.is_array() && json.size() == 3;
      if (!three || !takeUnsigned(json[0], v->x) || !takeUnsigned(json[1], v->y) || !takeUnsigned(json[2], v->z))
        return wrongType(field, ("three whole numbers, " + rangeText(field)).c_str(), json);
      return done();
    }
    Status operator()(std::string* v) const {
      if (!json.is_string()) return wrongType(field, ("one of " + join(field.names)).c_str(), json);
      *v = json.get<std::string>();
      return done();
    }
    Status operator()(const Choice& v) const {
      for (std::size_t i = 0; json.is_string() && i < field.names.size(); ++i) {
        if (json.get_ref<const std::string&>() != field.names[i]) continue;
        v.set(v.target, static_cast<int>(i));
        return done();
      }
      return wrongType(field, ("one of " + join(field.names)).c_str(), json);
    }
  };
  return std::visit(Visit{field, json}, field.target);
}

// Walk the object; every leaf must be a field's name. given: the fields that were read before, as an object may have
// both "surfels.count" and "count" in "surfels".
Status readObject(const Json& object, const std::string& prefix, const std::vector<Field>& table,
                  std::set<std::string>& given) {
  for (const auto& [key, value] : object.items()) {
    const std::string name = prefix + key;
    const auto field = std::find_if(table.begin(), table.end(), [&](const Field& f) { return name == f.name; });
    if (field != table.end()) {
      if (!given.insert(name).second)
        return Error{ErrorCode::usage, "options: " + name + " is given twice, as \"" + name + "\" and in \"" +
                                           name.substr(0, name.find('.')) + "\"; keep one of them"};
      if (const Status status = fromJson(*field, value); !status) return status;
      continue;
    }
    const bool group = prefix.empty() && std::any_of(table.begin(), table.end(), [&](const Field& f) {
                         return std::string_view(f.name).starts_with(name + ".");
                       });
    if (!group) return Error{ErrorCode::usage, "options: unknown key \"" + name.substr(0, 200) + "\""};
    if (!value.is_object()) return Error{ErrorCode::usage, "options: \"" + name + "\" must be an object"};
    if (const Status status = readObject(value, name + ".", table, given); !status) return status;
  }
  return done();
}

Error outOfRange(const Field& field, const std::string& found, const std::string& expected) {
  return {ErrorCode::usage, std::string("option ") + field.name +
                                (*field.flag ? std::string(" (") + field.flag + ")" : "") + " is " + found +
                                ", expected " + expected + (*field.unit ? std::string(" ") + field.unit : "")};
}

Status checkField(const Field& field) {
  const std::string range = rangeText(field);
  const auto within = [&](double v) { return v >= field.low && v <= field.high; };
  // Compare as floats: the end of a range, as a float, differs from the double in the table. False for NaN.
  const auto floatWithin = [&](float v) {
    return v >= static_cast<float>(field.low) && v <= static_cast<float>(field.high);
  };
  if (const auto* v = std::get_if<std::uint32_t*>(&field.target); v && !within(**v))
    return outOfRange(field, std::to_string(**v), range);
  if (const auto* v = std::get_if<float*>(&field.target); v && !floatWithin(**v))
    return outOfRange(field, std::isfinite(**v) ? number(shortest(**v)) : "not finite", range);
  if (const auto* v = std::get_if<glm::uvec3*>(&field.target);
      v && !(within((*v)->x) && within((*v)->y) && within((*v)->z)))
    return outOfRange(field, toJson(field).dump(), range);
  if (const auto* v = std::get_if<std::string*>(&field.target);
      v && std::none_of(field.names.begin(), field.names.end(), [&](const char* n) { return **v == n; }))
    return outOfRange(field, "\"" + **v + "\"", "one of " + range);
  if (const auto* v = std::get_if<Choice>(&field.target)) {
    const int index = v->get(v->target);
    if (index < 0 || static_cast<std::size_t>(index) >= field.names.size())
      return outOfRange(field, std::to_string(index), "one of " + range);
  }
  return done();
}

// Check the rules that involve several options.
Status checkTogether(const BakeOptions& o) {
  const auto usage = [](const std::string& message) { return Error{ErrorCode::usage, message}; };
  if (o.chromaBands > o.lumaBands)
    return usage("option chromaBands (--chroma-bands) is " + std::to_string(o.chromaBands) +
                 ", expected at most lumaBands (--luma-bands), " + std::to_string(o.lumaBands));
  if (o.links.kind == LinkKind::sh && o.lumaBands > o.links.bands)
    return usage("option lumaBands (--luma-bands) is " + std::to_string(o.lumaBands) +
                 ", expected at most links.bands (--link-bands) of SH links, " + std::to_string(o.links.bands));
  if (const std::uint64_t senders = std::uint64_t{o.surfels.count} + o.links.skyPatches;
      linkHasHead(o.links.kind) && 2 * senders - 1 > (1u << 20))
    return usage("options surfels.count (--surfels) and links.skyPatches (--sky-patches) are together " +
                 std::to_string(senders) +
                 ", expected at most 524288 with compact links; use links.kind (--link-kind) cone or sh");
  if (o.links.maxError > 0.0f && o.links.key != LinkOptions::CutKey::readError)
    return usage(
        "option links.maxError (--link-error) needs links.key (--cut-key) readError, for other keys are no errors");
  if (o.links.maxLinksPerCache > 0 && o.links.maxLinksPerCache < o.links.linksPerCache)
    return usage("option links.maxLinksPerCache (--max-links) is " + std::to_string(o.links.maxLinksPerCache) +
                 ", expected 0 or at least links.linksPerCache (--links), " + std::to_string(o.links.linksPerCache));
  if (o.links.linksPerCache > o.surfels.count)
    return usage("option links.linksPerCache (--links) is " + std::to_string(o.links.linksPerCache) +
                 ", expected at most surfels.count (--surfels), " + std::to_string(o.surfels.count));
  if (o.budget.any()) {
    const char* const fixed = o.links.linksTotal > 0          ? "links.linksTotal (--links-total)"
                              : o.caches.lightmapSize > 0     ? "caches.lightmapSize (--lightmap)"
                              : o.caches.gridSpacing > 0.0f   ? "caches.gridSpacing (--grid-spacing)"
                              : o.caches.gridResolution.x > 0 ? "caches.gridResolution (--grid)"
                                                              : nullptr;
    if (fixed)
      return usage(std::string("option ") + fixed + " is for bakes without a budget, which chooses it (--budget-mb, " +
                   "--budget-ms, --max-error)");
  }
  const glm::uvec3 grid = o.caches.gridResolution;
  const bool someZero = grid.x == 0 || grid.y == 0 || grid.z == 0;
  if (someZero && (grid.x != 0 || grid.y != 0 || grid.z != 0))
    return usage("option caches.gridResolution (--grid) has a zero beside a number, expected three of >= 1, or 0,0,0");
  if (std::uint64_t{grid.x} * grid.y * grid.z > (1u << 27))
    return usage("option caches.gridResolution (--grid) asks for " +
                 std::to_string(std::uint64_t{grid.x} * grid.y * grid.z) + " points, expected at most 134217728");
  if (o.caches.lightmapSize > 0 && o.caches.lightmapSize < 16)
    return usage("option caches.lightmapSize (--lightmap) is " + std::to_string(o.caches.lightmapSize) +
                 ", expected 0 or 16..16384 texel");
  const bool noGrid = someZero && o.caches.gridSpacing == 0.0f && o.caches.gridCaches == 0;
  if (noGrid && o.caches.lightmapSize == 0 && o.caches.lightmapCaches == 0)
    return usage(
        "options caches.gridCaches (--grid-caches) and caches.lightmapCaches (--lightmap-caches) are both 0, "
        "expected a grid, a light map, or both");
  return done();
}

// What other flags take as a number and JSON does not: ".5", "1.", "+0.5".
std::optional<double> plainNumber(std::string_view text) {
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

// Command-line text as the JSON that the field expects.
Json parseText(const Field& field, const std::string& text) {
  if (std::holds_alternative<Choice>(field.target) || std::holds_alternative<std::string*>(field.target)) return text;
  const bool list = std::holds_alternative<glm::uvec3*>(field.target);
  if (Result<Json> json = readJson(list ? "[" + text + "]" : text)) return std::move(*json);
  if (const std::optional<double> value = plainNumber(text); value && std::holds_alternative<float*>(field.target))
    return *value;
  return text;
}

}  // namespace

// Sizes are chosen by the error that they leave for their memory: docs/notes/cuts.md.
BakeOptions presetOptions(Preset preset) {
  BakeOptions options;  // the defaults are `high`
  switch (preset) {
    case Preset::draft:
      options.playSpace.walks = 1u << 16;
      options.surfels.count = 8192;
      options.caches.gridCaches = 256;
      options.caches.lightmapCaches = 768;
      options.links.linksPerCache = 64;
      options.links.raysPerCache = 512;
      options.links.bands = options.lumaBands = 3;
      break;
    case Preset::medium:
    case Preset::web:
      options.surfels.count = 32768;
      options.caches.lightmapCaches = 8192;
      options.links.linksPerCache = 128;
      options.links.bands = options.lumaBands = 3;
      if (preset == Preset::web) options.caches.gridCaches = 1800;
      break;
    case Preset::high:
      break;
    case Preset::best:
      options.playSpace.walks = 1u << 22;
      options.surfels.count = 327680;
      options.caches.gridCaches = 7168;
      options.caches.lightmapCaches = 73728;
      options.links.linksPerCache = 190;
      options.links.skyPatches = 256;
      break;
    case Preset::paper:  // PIC Table 2, setting 1
      options.clustering.method = ClusteringOptions::Method::exact;
      options.caches.lightmapCaches = 8281;
      options.links.linksPerCache = options.links.maxLinksPerCache = 254;
      options.links.raysPerCache = 4096;
      break;
  }
  return options;
}

Status checkOptions(const BakeOptions& options) {
  BakeOptions copy = options;
  for (const Field& field : fields(copy)) {
    if (const Status status = checkField(field); !status) return status;
  }
  return checkTogether(options);
}

std::string optionsToJson(const BakeOptions& options) {
  BakeOptions copy = options;
  Json json = Json::object();
  for (const Field& field : fields(copy)) {
    const std::string name = field.name;
    const std::size_t dot = name.find('.');
    (dot == std::string::npos ? json[name] : json[name.substr(0, dot)][name.substr(dot + 1)]) = toJson(field);
  }
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Result<BakeOptions> optionsFromJson(const std::string& text, const BakeOptions& base) {
  const Result<Json> json = readJson(text, JsonComments::skip);
  if (!json) return Error{ErrorCode::usage, "options: " + json.error().message};
  if (!json->is_object()) return Error{ErrorCode::usage, "options: expected a JSON object"};
  BakeOptions options = base;
  std::set<std::string> given;
  if (const Status status = readObject(*json, "", fields(options), given); !status) return status.error();
  return options;
}

std::vector<OptionInfo> listOptions(const BakeOptions& options) {
  BakeOptions copy = options;
  std::vector<OptionInfo> list;
  for (const Field& field : fields(copy))
    list.push_back({field.name, field.flag, rangeText(field), field.unit, toJson(field).dump(), field.comment});
  return list;
}

Status setOption(BakeOptions& options, const std::string& name, const std::string& text) {
  for (const Field& field : fields(options)) {
    if (name == field.name) return fromJson(field, parseText(field, text));
  }
  return Error{ErrorCode::usage, "unknown option \"" + name + "\""};
}

}  // namespace relume
