// SPDX-License-Identifier: MIT
// See lightmap_primitives.h. Instances are taken primitive by primitive, whose source is read once; instances of one
// primitive that are split alike share all that is not their coordinates.
#include "bake/export/lightmap_primitives.h"

#include "bake/export/split_vertices.h"
#include "bake/export/vertex_data.h"
#include "bake/import/gltf_import.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <utility>

namespace relume {
namespace {

using nlohmann::json;

// A primitive of the file as triangles.
struct SourcePrimitive {
  std::string where;
  json element;                                 // of the document, as it was
  const tinygltf::Primitive* parsed = nullptr;  // the importer's
  std::optional<DracoPrimitive> draco;
  std::uint32_t vertexCount = 0;
  std::vector<std::uint32_t> corner;  // [Size 3 * triangles] vertex, in drawing order
  bool compact = false;               // most of its vertices are other primitives'
};

// What depends on the shape that morph weights give a primitive.
struct SourceShape {
  std::vector<std::uint32_t> likes;  // [Size 3 * triangles] corner whose light it takes: its own, or for a triangle
                                     // that the repair took out, that of the triangle it lies on
  std::vector<std::uint8_t> unseen;  // [Size triangles]
};

bool isAt(const glm::uvec3& triangle, std::uint32_t vertex) { return triangle == glm::uvec3(vertex); }

Error changed(const LevelDocument& document, const std::string& where) {
  return {ErrorCode::failed, document.source().at(where + ": is not what was read before; the file has changed")};
}

// Which triangles have no area, and what those that the repair collapsed lie on.
Result<SourceShape> findUnseen(const LevelDocument& document, const Mesh& mesh, const SourcePrimitive& source) {
  // The importer keeps the vertices in use, in their order.
  std::vector<std::uint32_t> rank(source.vertexCount, 0);
  for (const std::uint32_t v : source.corner) rank[v] = 1;
  std::uint32_t used = 0;
  for (std::uint32_t& r : rank) r = r == 0 ? kNone : used++;
  const std::size_t triangles = source.corner.size() / 3;
  if (used != mesh.position.size() || triangles != mesh.triangle.size()) return changed(document, source.where);

  SourceShape out;
  out.likes.resize(source.corner.size());
  std::iota(out.likes.begin(), out.likes.end(), 0u);
  out.unseen.assign(triangles, 0);
  const auto position = [&](std::size_t corner) { return mesh.position[rank[source.corner[corner]]]; };
  const auto collapsed = [&](std::size_t t) {
    const glm::uvec3& now = mesh.triangle[t];
    return isAt(now, now.x) &&
           !(source.corner[3 * t] == source.corner[3 * t + 1] && source.corner[3 * t] == source.corner[3 * t + 2]);
  };
  // A triangle's three positions from its smallest one on, and the corner that has that.
  using Outline = std::array<float, 9>;
  const auto outlineOf = [&](std::size_t t) {
    std::array<Outline, 3> turned;
    for (std::size_t first = 0; first < 3; ++first) {
      for (std::size_t k = 0; k < 3; ++k) {
        const glm::vec3 p = position(3 * t + (first + k) % 3);
        turned[first][3 * k] = p.x, turned[first][3 * k + 1] = p.y, turned[first][3 * k + 2] = p.z;
      }
    }
    const auto min = std::min_element(turned.begin(), turned.end());
    return std::pair<Outline, std::size_t>(*min, static_cast<std::size_t>(min - turned.begin()));
  };
  std::vector<std::size_t> doubles;
  for (std::size_t t = 0; t < triangles; ++t) {
    const glm::vec3 a = position(3 * t), b = position(3 * t + 1), c = position(3 * t + 2);
    out.unseen[t] = glm::cross(b - a, c - a) == glm::vec3(0.0f);
    if (!out.unseen[t] && collapsed(t)) doubles.push_back(t);
  }
  if (doubles.empty()) return out;
  std::map<Outline, std::pair<std::size_t, std::size_t>> first;  // triangle, the corner it begins at
  for (std::size_t t = 0; t < triangles; ++t) {
    if (out.unseen[t] || collapsed(t)) continue;
    const auto [outline, begin] = outlineOf(t);
    first.try_emplace(outline, t, begin);
  }
  for (const std::size_t t : doubles) {
    const auto [outline, begin] = outlineOf(t);
    const auto found = first.find(outline);
    out.unseen[t] = found == first.end();
    for (std::size_t k = 0; k < 3 && found != first.end(); ++k)
      out.likes[3 * t + (begin + k) % 3] =
          static_cast<std::uint32_t>(3 * found->second.first + (found->second.second + k) % 3);
  }
  return out;
}

Result<SourcePrimitive> readSource(const LevelDocument& document, AccessorReader& reader, std::uint32_t mesh,
                                   std::uint32_t primitive) {
  const tinygltf::Model& model = document.source().model;
  SourcePrimitive out;
  out.where = jsonPath("meshes", static_cast<int>(mesh)) + "." + jsonPath("primitives", static_cast<int>(primitive));
  if (mesh >= model.meshes.size() || primitive >= model.meshes[mesh].primitives.size())
    return changed(document, out.where);
  out.parsed = &model.meshes[mesh].primitives[primitive];
  out.element = document.meshesBefore().at(mesh).at("primitives").at(primitive);

  std::vector<std::uint32_t> indices;
  if (out.parsed->extensions.contains(kDracoExtension)) {
    Result<DracoPrimitive> draco = decodeDraco(document.source(), *out.parsed, out.where);
    if (!draco) return draco.error();
    out.draco = std::move(*draco);
    indices = std::move(out.draco->indices);
    const auto position = out.draco->attributes.find("POSITION");
    if (position == out.draco->attributes.end())
      return document.source().invalid(out.where, "its Draco data has no POSITION");
    out.vertexCount = static_cast<std::uint32_t>(position->second.count);
  } else {
    const json& accessor =
        document.root.at("accessors").at(out.element.at("attributes").at("POSITION").get<std::size_t>());
    out.vertexCount = accessor.at("count").get<std::uint32_t>();
    if (out.parsed->indices >= 0) {
      Result<std::vector<std::uint32_t>> read = reader.indices(out.parsed->indices, out.where + ".indices");
      if (!read) return read.error();
      indices = std::move(*read);
    } else {
      indices.resize(out.vertexCount);
      std::iota(indices.begin(), indices.end(), 0u);
    }
  }
  out.corner = unrollTriangles(std::move(indices), out.draco ? TINYGLTF_MODE_TRIANGLES : out.parsed->mode);
  std::vector<std::uint8_t> used(out.vertexCount, 0);
  for (const std::uint32_t v : out.corner) {
    if (v >= out.vertexCount) return changed(document, out.where);
    used[v] = 1;
  }
  // Primitives may share one large set of vertices, of which a copy each would be too many; but extensions may name
  // vertices by their numbers.
  const bool named =
      out.element.contains("extensions") &&
      std::any_of(out.element["extensions"].items().begin(), out.element["extensions"].items().end(),
                  [](const auto& e) { return e.key() != kDracoExtension && e.key() != "KHR_materials_variants"; });
  out.compact = !named && 2 * static_cast<std::size_t>(std::count(used.begin(), used.end(), 1)) < used.size();
  return out;
}

// Everything of split vertices but their coordinates, shared by instances that are split alike.
class Copies {
 public:
  Copies(LevelDocument& document, const SourcePrimitive& source) : document_(document), source_(source) {}

  // The primitive with its attributes, targets and indices as `split` has them.
  Result<json> primitive(const SplitVertices& split) {
    json out = source_.element;
    if (split.kept && !source_.draco) return out;
    const auto known = vertices_.find(split.source);
    if (known == vertices_.end()) {
      if (const Status status = copyVertices(split, out); !status) return status.error();
      vertices_.emplace(split.source,
                        json{{"attributes", out["attributes"]}, {"targets", out.value("targets", json())}});
    } else {
      out["attributes"] = known->second["attributes"];
      if (out.contains("targets")) out["targets"] = known->second["targets"];
    }
    const auto [corners, fresh] = indices_.try_emplace(split.corner, 0);
    if (fresh) {
      const int type = out.contains("indices") ? document_.root["accessors"][out["indices"].get<std::size_t>()].value(
                                                     "componentType", TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT)
                                               : TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT;
      corners->second = addIndices(document_, split.corner, static_cast<std::uint32_t>(split.source.size()), type);
    }
    out["indices"] = corners->second;
    if (out.contains("mode")) out["mode"] = TINYGLTF_MODE_TRIANGLES;
    if (source_.draco) out["extensions"].erase(kDracoExtension);
    if (out.contains("extensions") && out["extensions"].empty()) out.erase("extensions");
    return out;
  }

 private:
  Status copyVertices(const SplitVertices& split, json& out) {
    for (auto& [name, accessor] : out["attributes"].items()) {
      if (const Status status = copy(name, split.source, source_.where + ".attributes." + name, accessor); !status)
        return status;
    }
    if (!out.contains("targets")) return done();
    for (json& target : out["targets"]) {
      for (auto& [name, accessor] : target.items()) {
        if (const Status status = copy("", split.source, source_.where + ".targets." + name, accessor); !status)
          return status;
      }
    }
    return done();
  }

  // Put the accessor of the copies in the place of `accessor`; attributes of Draco's by name.
  Status copy(const std::string& name, std::span<const std::uint32_t> vertices, const std::string& where,
              json& accessor) {
    const int index = accessor.get<int>();
    const bool decoded = !name.empty() && source_.draco && source_.draco->attributes.contains(name);
    const Result<RawElements> elements = decoded
                                             ? encodeRaw(document_, index, source_.draco->attributes.at(name), where)
                                             : readRaw(document_, index, where);
    if (!elements) return elements.error();
    const Result<int> copied = copyElements(document_, index, *elements, vertices, where);
    if (!copied) return copied.error();
    accessor = *copied;
    return done();
  }

  LevelDocument& document_;
  const SourcePrimitive& source_;
  std::map<std::vector<std::uint32_t>, json> vertices_;
  std::map<std::vector<std::uint32_t>, int> indices_;
};

// Where an instance's corners are on the map; nothing where none is.
std::optional<ChartedCorners> cornersOf(const SourcePrimitive& source, const SourceShape& shape, const Lightmap& map,
                                        std::uint32_t instance) {
  const LightmapPart& part = map.parts[instance];
  ChartedCorners out;
  out.front.resize(source.corner.size());
  out.back.resize(source.corner.size());
  bool any = false;
  for (std::size_t c = 0; c < source.corner.size(); ++c) {
    const std::uint64_t at = part.firstCorner + shape.likes[c];
    out.front[c] = at < map.cornerUv.size() ? map.cornerUv[at] : kGridLit;
    out.back[c] = at < map.backCornerUv.size() ? map.backCornerUv[at] : kGridLit;
    any |= out.front[c] != kGridLit || out.back[c] != kGridLit;
  }
  if (!any) return std::nullopt;
  out.vertex = source.corner;
  out.unseen = shape.unseen;
  return out;
}

class Maker {
 public:
  Maker(LevelDocument& document, const Scene& scene, const Lightmap& map, TexcoordSets sets)
      : document_(document), scene_(scene), map_(map), sets_(sets), reader_(document.source()) {}

  // All instances of one primitive.
  Status make(std::uint32_t mesh, std::uint32_t primitive, std::span<const std::uint32_t> instances,
              LightmapPrimitives& out) {
    const Result<SourcePrimitive> source = readSource(document_, reader_, mesh, primitive);
    if (!source) return source.error();
    Copies copies(document_, *source);
    std::map<std::uint32_t, SourceShape> shapes;  // by the scene's mesh
    for (const std::uint32_t i : instances) {
      if (3ull * map_.parts[i].triangleCount != source->corner.size()) return changed(document_, source->where);
      const std::uint32_t imported = scene_.instances[i].mesh;
      auto shape = shapes.find(imported);
      if (shape == shapes.end()) {
        Result<SourceShape> found = findUnseen(document_, scene_.meshes[imported], *source);
        if (!found) return found.error();
        shape = shapes.emplace(imported, std::move(*found)).first;
      }
      const std::optional<ChartedCorners> corners = cornersOf(*source, shape->second, map_, i);
      if (!corners) continue;
      const SplitVertices split = splitVertices(*corners, source->vertexCount, source->compact);
      Result<json> made = copies.primitive(split);
      if (!made) return made.error();
      addSets(split, *made, out);
      out.vertices += split.source.size() - split.added;
      out.added += split.added;
      out.ofInstance.emplace(i, std::move(*made));
    }
    return done();
  }

 private:
  void addSets(const SplitVertices& split, json& primitive, LightmapPrimitives& out) {
    json& attributes = primitive["attributes"];
    // Sets count on from 0: those between are zero, which is what one reads where there is none.
    for (int set = 0; set < sets_.front; ++set) {
      const std::string name = "TEXCOORD_" + std::to_string(set);
      if (!attributes.contains(name)) attributes[name] = zeros(split.source.size());
    }
    attributes["TEXCOORD_" + std::to_string(sets_.front)] = addCoordinates(document_, split.front);
    const bool back = std::any_of(split.back.begin(), split.back.end(), [](std::uint32_t b) { return b != kGridLit; });
    if (back) attributes["TEXCOORD_" + std::to_string(sets_.back())] = addCoordinates(document_, split.back);
    nameSets(primitive, sets_, back);
    out.backs |= back;
  }

  int zeros(std::size_t count) {
    const auto [found, fresh] = zeros_.try_emplace(count, 0);
    if (fresh)
      found->second = document_.addAccessor({{"componentType", TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT},
                                             {"normalized", true},
                                             {"count", count},
                                             {"type", "VEC2"}});
    return found->second;
  }

  LevelDocument& document_;
  const Scene& scene_;
  const Lightmap& map_;
  TexcoordSets sets_;
  AccessorReader reader_;
  std::map<std::size_t, int> zeros_;
};

// A primitive of Draco's as a plain one with the same vertices.
Result<json> decodeWhole(LevelDocument& document, AccessorReader& reader, std::uint32_t mesh, std::uint32_t primitive) {
  const Result<SourcePrimitive> source = readSource(document, reader, mesh, primitive);
  if (!source) return source.error();
  SplitVertices whole;
  whole.source.resize(source->vertexCount);
  std::iota(whole.source.begin(), whole.source.end(), 0u);
  whole.corner = source->corner;
  return Copies(document, *source).primitive(whole);
}

}  // namespace

TexcoordSets chooseSets(const json& root) {
  TexcoordSets sets;
  if (!root.contains("meshes")) return sets;
  std::set<std::string> taken;
  for (const json& mesh : root["meshes"]) {
    for (const json& primitive : mesh["primitives"]) {
      for (const auto& attribute : primitive["attributes"].items()) taken.insert(attribute.key());
    }
  }
  const auto isTaken = [&](int set) { return taken.contains("TEXCOORD_" + std::to_string(set)); };
  while (isTaken(sets.front) || isTaken(sets.back())) ++sets.front;
  return sets;
}

void nameSets(json& element, TexcoordSets sets, bool back) {
  json& extras = element["extras"];
  if (extras.is_null()) extras = json::object();
  if (!extras.is_object() || (extras.contains("relume") && !extras["relume"].is_object())) return;
  extras["relume"]["lightmapTexcoord"] = sets.front;
  if (back) extras["relume"]["backLightmapTexcoord"] = sets.back();
}

Result<LightmapPrimitives> makeLightmapPrimitives(LevelDocument& document, const Scene& scene, const Lightmap& map,
                                                  TexcoordSets sets, Context& context) {
  // Those that may be on the map, by primitive of the file.
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::uint32_t>> instances;
  const auto& nodes = document.source().model.nodes;
  for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
    const Instance& instance = scene.instances[i];
    if (!instance.charted() || i >= map.parts.size() || map.parts[i].triangleCount == 0) continue;
    if (instance.nodeIndex >= nodes.size() || nodes[instance.nodeIndex].mesh < 0)
      return changed(document, jsonPath("nodes", static_cast<int>(instance.nodeIndex)));
    instances[{static_cast<std::uint32_t>(nodes[instance.nodeIndex].mesh), instance.primitive}].push_back(i);
  }
  LightmapPrimitives out;
  Maker maker(document, scene, map, sets);
  std::size_t made = 0;
  for (const auto& [primitive, members] : instances) {
    if (!context.progress("export", static_cast<double>(made++) / static_cast<double>(instances.size())))
      return cancelledError();
    if (const Status status = maker.make(primitive.first, primitive.second, members, out); !status)
      return status.error();
  }
  return out;
}

Status decodeRest(LevelDocument& document, Context& context) {
  const auto isCompressed = [](const json& primitive) {
    return primitive.contains("extensions") && primitive["extensions"].contains(kDracoExtension);
  };
  // Copies of meshes have primitives of the meshes that they are copies of.
  std::map<json, std::pair<std::uint32_t, std::uint32_t>> places;
  const json& before = document.meshesBefore();
  for (std::uint32_t m = 0; m < before.size(); ++m) {
    const json& primitives = before[m].at("primitives");
    for (std::uint32_t p = 0; p < primitives.size(); ++p) {
      if (isCompressed(primitives[p])) places.try_emplace(primitives[p], m, p);
    }
  }
  if (places.empty()) return done();

  AccessorReader reader(document.source());
  std::map<json, json> decoded;
  for (json& mesh : document.root["meshes"]) {
    for (json& primitive : mesh.at("primitives")) {
      if (!isCompressed(primitive)) continue;
      if (context.cancelled()) return cancelledError();
      const auto [known, fresh] = decoded.try_emplace(primitive);
      if (fresh) {
        const auto& [m, p] = places.at(primitive);
        Result<json> made = decodeWhole(document, reader, m, p);
        if (!made) return made.error();
        known->second = std::move(*made);
      }
      primitive = known->second;
    }
  }
  return done();
}

}  // namespace relume
