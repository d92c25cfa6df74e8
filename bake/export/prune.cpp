// SPDX-License-Identifier: MIT
// See prune.h.
#include "bake/export/prune.h"

#include "bake/export/vertex_data.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace relume {
namespace {

using nlohmann::json;

constexpr std::uint64_t kStep = 16;  // [byte] cuts begin at multiples of it and are as long: what follows stays aligned

using Numbers = std::set<std::uint64_t>;

// Extensions whose integers are other things than accessors and views, or are looked at by name below.
bool isHarmless(std::string_view name) {
  constexpr std::array<std::string_view, 10> kKnown{
      kDracoExtension,       kMeshoptExtensions[0],   kMeshoptExtensions[1], "KHR_animation_pointer",
      "KHR_lights_punctual", "KHR_mesh_quantization", "KHR_texture_basisu",  "KHR_texture_transform",
      "EXT_texture_webp",    "MSFT_texture_dds"};
  return name.starts_with("KHR_materials_") || std::find(kKnown.begin(), kKnown.end(), name) != kKnown.end();
}

// floats: 3.0 counts as well.
void collectIntegers(const json& value, bool floats, Numbers& out) {
  if (value.is_number_unsigned()) out.insert(value.get<std::uint64_t>());
  if (floats && value.is_number_float()) {
    constexpr double kMax = 4294967295.0;
    const double number = value.get<double>();
    if (number >= 0.0 && number <= kMax && number == std::floor(number)) out.insert(static_cast<std::uint64_t>(number));
  }
  if (!value.is_structured()) return;
  for (const json& member : value) collectIntegers(member, floats, out);
}

// Integers that somebody unknown may read as a number of an accessor or a view.
void collectUnknown(const json& value, bool floats, Numbers& out) {
  if (!value.is_structured()) return;
  if (value.is_array()) {
    for (const json& member : value) collectUnknown(member, floats, out);
    return;
  }
  for (const auto& [name, member] : value.items()) {
    if (name == "extras") {
      for (const auto& [key, extra] : member.items()) {
        if (key != "relume") collectIntegers(extra, floats, out);  // ours names neither
      }
    } else if (name == "extensions" && member.is_object()) {
      for (const auto& [extension, content] : member.items()) {
        if (isHarmless(extension))
          collectUnknown(content, floats, out);
        else
          collectIntegers(content, floats, out);
      }
    } else {
      collectUnknown(member, floats, out);
    }
  }
}

void add(const json& object, const char* name, Numbers& out) {
  const auto found = object.find(name);
  if (found != object.end() && found->is_number_unsigned()) out.insert(found->get<std::uint64_t>());
}

const json& listOf(const json& object, const char* name) {
  static const json kNone = json::array();
  const auto found = object.find(name);
  return found != object.end() && found->is_array() ? *found : kNone;
}

// What primitives refer to.
struct References {
  Numbers accessors, views;
};

References ofPrimitives(const json& meshes, bool floats) {
  References out;
  for (const json& mesh : meshes) {
    for (const json& primitive : listOf(mesh, "primitives")) {
      collectIntegers(primitive.value("attributes", json::object()), floats, out.accessors);
      collectIntegers(primitive.value("targets", json::array()), floats, out.accessors);
      add(primitive, "indices", out.accessors);
      const json::json_pointer draco(std::string("/extensions/") + kDracoExtension);
      if (primitive.contains(draco)) add(primitive[draco], "bufferView", out.views);
    }
  }
  return out;
}

void addViewsOf(const json& accessor, Numbers& views) {
  add(accessor, "bufferView", views);
  for (const char* part : {"/sparse/indices", "/sparse/values"}) {
    const json::json_pointer pointer(part);
    if (accessor.contains(pointer)) add(accessor[pointer], "bufferView", views);
  }
}

// The accessors and views that nothing refers to any more, and the views of which accessors are left.
struct Dead {
  Numbers accessors;
  Numbers views;
  Numbers shared;  // plain views, of which some accessors died
};

Dead findDead(const json& root, const json& before, bool floats) {
  const References was = ofPrimitives(before, floats), is = ofPrimitives(listOf(root, "meshes"), floats);
  Numbers live = is.accessors, unknown;
  collectUnknown(root, floats, unknown);
  for (const json& skin : listOf(root, "skins")) add(skin, "inverseBindMatrices", live);
  for (const json& animation : listOf(root, "animations")) {
    for (const json& sampler : listOf(animation, "samplers")) {
      add(sampler, "input", live);
      add(sampler, "output", live);
    }
  }
  Dead dead;
  for (const std::uint64_t accessor : was.accessors) {
    if (!live.contains(accessor) && !unknown.contains(accessor)) dead.accessors.insert(accessor);
  }

  Numbers candidates = was.views, used, whole = is.views;
  const json &accessors = listOf(root, "accessors"), &views = listOf(root, "bufferViews");
  for (std::uint64_t i = 0; i < accessors.size(); ++i) {
    const bool died = dead.accessors.contains(i);
    // How long sparse parts are, other numbers say: their views are kept as a whole.
    addViewsOf(accessors[i], died ? candidates : accessors[i].contains("sparse") ? whole : used);
  }
  for (const json& image : listOf(root, "images")) add(image, "bufferView", whole);
  whole.insert(unknown.begin(), unknown.end());
  for (const std::uint64_t view : candidates) {
    if (view >= views.size() || whole.contains(view)) continue;
    if (!used.contains(view))
      dead.views.insert(view);
    else if (!views[view].contains("extensions"))
      dead.shared.insert(view);
  }
  return dead;
}

// [byte] of the one buffer; empty for what lies in another.
ByteRange rangeOf(const json& element) {
  if (element.value("buffer", std::uint64_t{0}) != 0) return {0, 0};
  const auto begin = element.value("byteOffset", std::uint64_t{0});
  return {begin, begin + element.value("byteLength", std::uint64_t{0})};
}

// A view, and what its extensions decode it from.
std::vector<ByteRange> rangesOf(const json& view) {
  std::vector<ByteRange> out{rangeOf(view)};
  if (!view.contains("extensions")) return out;
  for (const json& extension : view["extensions"]) {
    if (extension.is_object() && extension.contains("buffer")) out.push_back(rangeOf(extension));
  }
  return out;
}

ByteRange elementsOf(const json& accessor, const json& view) {
  const std::uint64_t stride = view.value("byteStride", std::uint64_t{elementBytes(accessor)});
  const std::uint64_t begin = rangeOf(view).begin + accessor.value("byteOffset", std::uint64_t{0});
  return {begin, std::min(begin + stride * accessor.value("count", std::uint64_t{0}), rangeOf(view).end)};
}

// What of `dead` is in none of `live`, in whole steps, in order.
std::vector<ByteRange> findCuts(std::vector<ByteRange> dead, std::vector<ByteRange> live) {
  const auto byBegin = [](const ByteRange& a, const ByteRange& b) { return a.begin < b.begin; };
  std::sort(dead.begin(), dead.end(), byBegin);
  std::sort(live.begin(), live.end(), byBegin);
  std::vector<ByteRange> cuts;
  const auto cut = [&](std::uint64_t begin, std::uint64_t end) {
    begin = (begin + kStep - 1) / kStep * kStep;
    if (end >= begin + kStep) cuts.push_back({begin, begin + (end - begin) / kStep * kStep});
  };
  std::uint64_t at = 0;  // all before it is decided
  std::size_t next = 0;
  for (std::size_t i = 0; i < dead.size();) {
    ByteRange range{std::max(dead[i].begin, at), dead[i].end};
    for (++i; i < dead.size() && dead[i].begin <= range.end; ++i) range.end = std::max(range.end, dead[i].end);
    at = range.begin;
    for (; next < live.size() && live[next].begin < range.end; ++next) {
      if (live[next].begin > at) cut(at, live[next].begin);
      at = std::max(at, live[next].end);
    }
    if (range.end > at) cut(at, range.end);
    at = std::max(at, range.end);
  }
  return cuts;
}

// Where bytes are after the cuts.
class Mover {
 public:
  explicit Mover(const std::vector<ByteRange>& cuts) : cuts_(cuts) {
    for (const ByteRange& cut : cuts) removed_.push_back(removed_.back() + cut.end - cut.begin);
  }

  // A byte that was cut is where the next one is.
  std::uint64_t movedTo(std::uint64_t at) const {
    const auto next = std::lower_bound(cuts_.begin(), cuts_.end(), at,
                                       [](const ByteRange& cut, std::uint64_t value) { return cut.end < value; });
    const std::uint64_t before = removed_[static_cast<std::size_t>(next - cuts_.begin())];
    return at - before - (next != cuts_.end() && next->begin < at ? at - next->begin : 0);
  }

  void move(json& element) const {
    const ByteRange range = rangeOf(element);
    if (range.end == range.begin) return;
    element["byteOffset"] = movedTo(range.begin);
    element["byteLength"] = movedTo(range.end) - movedTo(range.begin);
  }

 private:
  const std::vector<ByteRange>& cuts_;
  std::vector<std::uint64_t> removed_{0};  // [Size cuts + 1] before each
};

// What is left of an element that nothing refers to.
json husk(const json& element, const json& content) {
  json out = content;
  for (const char* name : {"name", "extras"}) {
    if (element.contains(name)) out[name] = element[name];
  }
  return out;
}

}  // namespace

std::uint64_t pruneDocument(LevelDocument& document) {
  json& root = document.root;
  const Dead dead = findDead(root, document.meshesBefore(), document.wholeAsFloats());
  if (dead.accessors.empty() && dead.views.empty()) return 0;

  // 1. The bytes that nobody reads
  std::vector<ByteRange> unused, used;
  for (std::uint64_t i = 0; i < listOf(root, "bufferViews").size(); ++i) {
    const std::vector<ByteRange> ranges = rangesOf(root["bufferViews"][i]);
    std::vector<ByteRange>& list = dead.views.contains(i) || dead.shared.contains(i) ? unused : used;
    list.insert(list.end(), ranges.begin(), ranges.end());
  }
  for (std::uint64_t i = 0; i < listOf(root, "accessors").size(); ++i) {
    const json& accessor = root["accessors"][i];
    if (dead.accessors.contains(i) || !accessor.contains("bufferView")) continue;
    const auto view = accessor["bufferView"].get<std::uint64_t>();
    if (dead.shared.contains(view)) used.push_back(elementsOf(accessor, root["bufferViews"][view]));
  }
  const std::vector<ByteRange> cuts = findCuts(std::move(unused), std::move(used));

  const Mover mover(cuts);

  // 2. What is left of their accessors and views
  for (const std::uint64_t i : dead.accessors) {
    json& accessor = root["accessors"][i];
    accessor = husk(accessor, {{"componentType", accessor["componentType"]}, {"type", accessor["type"]}, {"count", 1}});
  }
  for (const std::uint64_t i : dead.views) {
    json& view = root["bufferViews"][i];
    view = husk(view, {{"buffer", 0}, {"byteLength", 4}});
  }

  // 3. Move all others
  for (json& accessor : root["accessors"]) {
    if (!accessor.contains("bufferView")) continue;
    const auto view = accessor["bufferView"].get<std::uint64_t>();
    if (!dead.shared.contains(view)) continue;
    const std::uint64_t begin = rangeOf(root["bufferViews"][view]).begin;
    accessor["byteOffset"] =
        mover.movedTo(begin + accessor.value("byteOffset", std::uint64_t{0})) - mover.movedTo(begin);
  }
  for (std::uint64_t i = 0; i < root["bufferViews"].size(); ++i) {
    if (dead.views.contains(i)) continue;
    json& view = root["bufferViews"][i];
    mover.move(view);
    if (!view.contains("extensions")) continue;
    for (json& extension : view["extensions"]) {
      if (extension.is_object() && extension.contains("buffer")) mover.move(extension);
    }
  }
  return document.cut(cuts);
}

}  // namespace relume
