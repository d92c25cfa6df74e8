// SPDX-License-Identifier: MIT
// See find_solids.h.
#include "bake/import/find_solids.h"

#include "bake/base/parallel.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <span>
#include <tuple>

namespace relume {
namespace {

// Smallest volume of a solid over its surface to the power 3/2. A ball has 0.094, a sheet of two equal layers about 0.
constexpr double kMinVolume = 1e-6;
// Most witnesses of rooms that are tested, and most points of each.
constexpr std::size_t kMaxWitnesses = 256;
constexpr std::uint32_t kVolumePoints = 3;  // along an axis of a play volume
constexpr std::size_t kContentPoints = 8;

using Group = std::vector<std::uint32_t>;  // meshes or instances that make up one glTF node

// A triangle of a group, its corners numbered by position.
struct Face {
  std::array<std::uint32_t, 3> corner;
};

struct Shell {
  std::vector<std::uint32_t> face;  // of its group
  glm::dvec3 low{0.0}, high{0.0};   // [object units]
};

// The triangles of a group's meshes, one after the other, and the closed shells among them.
struct Shells {
  std::vector<glm::vec3> position;     // [object units] of all meshes
  std::vector<Face> face;              // corners of copies and of triangles without area are all 0
  std::vector<std::uint32_t> shellOf;  // [Size face] kNone = open
  std::vector<Shell> shell;
};

bool finite(const glm::vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

// Whether an alpha mask may cut something out of a mesh.
bool hasHoles(const Scene& scene, const Mesh& mesh) {
  if (mesh.material >= scene.materials.size()) return false;
  const Material& material = scene.materials[mesh.material];
  if (material.alphaMode != AlphaMode::mask) return false;
  float alpha = material.alpha;
  for (const float a : mesh.colorAlpha) alpha = std::min(alpha, material.alpha * a);
  const std::uint32_t image = material.albedoTexture.image;
  if (image < scene.images.size() && !scene.images[image].levels.empty()) {
    const std::vector<std::uint8_t>& rgba = scene.images[image].levels[0].rgba;
    std::uint8_t min = 255;
    for (std::size_t i = 3; i < rgba.size(); i += 4) min = std::min(min, rgba[i]);
    alpha *= static_cast<float>(min) / 255.0f;
  }
  return alpha < material.alphaCutoff;
}

// One number for each distinct position.
std::vector<std::uint32_t> weld(const std::vector<glm::vec3>& position) {
  std::vector<std::uint32_t> order(position.size()), welded(position.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto key = [&](std::uint32_t v) { return std::tuple(position[v].x, position[v].y, position[v].z); };
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return key(a) != key(b) ? key(a) < key(b) : a < b; });
  for (std::size_t i = 0; i < order.size(); ++i)
    welded[order[i]] = i > 0 && key(order[i]) == key(order[i - 1]) ? welded[order[i - 1]] : order[i];
  return welded;
}

// Disjoint sets of faces (union-find).
class Sets {
 public:
  explicit Sets(std::size_t size) : up_(size) { std::iota(up_.begin(), up_.end(), 0u); }
  std::uint32_t root(std::uint32_t f) {
    while (up_[f] != f) f = up_[f] = up_[up_[f]];
    return f;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = root(a), b = root(b);
    up_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> up_;
};

// Lists the faces of a group; `open` marks those that can be part of no shell.
void listFaces(const Scene& scene, const Group& meshes, Shells& shells, std::vector<std::uint8_t>& open) {
  std::vector<std::uint32_t> first;
  for (const std::uint32_t m : meshes) {
    first.push_back(static_cast<std::uint32_t>(shells.position.size()));
    for (const glm::vec3& p : scene.meshes[m].position)
      shells.position.push_back(finite(p) ? p + 0.0f : glm::vec3(0.0f));
  }
  const std::vector<std::uint32_t> welded = weld(shells.position);
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    const Mesh& mesh = scene.meshes[meshes[i]];
    const bool holes = hasHoles(scene, mesh);
    for (const glm::uvec3& t : mesh.triangle) {
      Face face{};
      bool good = !holes;
      for (int k = 0; k < 3; ++k) {
        good = good && finite(mesh.position[t[k]]);
        face.corner[static_cast<std::size_t>(k)] = welded[first[i] + t[k]];
      }
      std::rotate(face.corner.begin(), std::min_element(face.corner.begin(), face.corner.end()), face.corner.end());
      const auto& [a, b, c] = face.corner;
      if (a == b || b == c) face = {};
      shells.face.push_back(face);
      open.push_back(good ? 0 : 1);
    }
  }

  // Copies lie on the first of their kind and count once.
  std::vector<std::uint32_t> order(shells.face.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return shells.face[a].corner != shells.face[b].corner ? shells.face[a].corner < shells.face[b].corner : a < b;
  });
  std::vector<std::uint32_t> copies;
  for (std::size_t i = 1; i < order.size(); ++i) {
    if (shells.face[order[i]].corner == shells.face[order[i - 1]].corner) copies.push_back(order[i]);
  }
  for (const std::uint32_t f : copies) shells.face[f] = {};
}

// Join faces over edges. A set is open if it has an edge that its faces do not pass equally often in both directions.
void joinFaces(const Shells& shells, Sets& sets, std::vector<std::uint8_t>& open) {
  // An edge as a face passes it, listed by its lower corner.
  struct Half {
    std::uint32_t high, face;
    int way;
  };
  const auto forEachHalf = [&](const auto& visit) {
    for (std::uint32_t f = 0; f < shells.face.size(); ++f) {
      const auto& corner = shells.face[f].corner;
      if (corner[0] == corner[1]) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = corner[k], b = corner[(k + 1) % 3];
        visit(std::min(a, b), Half{std::max(a, b), f, a < b ? 1 : -1});
      }
    }
  };
  std::vector<std::uint32_t> endOf(shells.position.size() + 1, 0);
  forEachHalf([&](std::uint32_t low, const Half&) { ++endOf[low + 1]; });
  std::partial_sum(endOf.begin(), endOf.end(), endOf.begin());
  std::vector<Half> halves(endOf.back());
  forEachHalf([&](std::uint32_t low, const Half& half) { halves[endOf[low]++] = half; });

  std::size_t begin = 0;
  for (std::size_t low = 0; low < shells.position.size(); ++low) {
    const std::size_t last = endOf[low];
    std::sort(halves.begin() + static_cast<std::ptrdiff_t>(begin), halves.begin() + static_cast<std::ptrdiff_t>(last),
              [](const Half& a, const Half& b) { return std::tie(a.high, a.face) < std::tie(b.high, b.face); });
    for (std::size_t end = begin; begin < last; begin = end) {
      int balance = 0;
      for (; end < last && halves[end].high == halves[begin].high; ++end) {
        balance += halves[end].way;
        sets.join(halves[begin].face, halves[end].face);
      }
      if (balance != 0) open[halves[begin].face] = 1;
    }
  }
}

glm::dvec3 cornerOf(const Shells& shells, std::uint32_t face, std::size_t k) {
  return shells.position[shells.face[face].corner[k]];
}

// Whether the fronts of a closed shell face outward; sets its bounds.
bool measure(const Shells& shells, Shell& shell) {
  const glm::dvec3 origin = cornerOf(shells, shell.face[0], 0);
  double volume = 0.0, area = 0.0;
  shell.low = shell.high = origin;
  for (const std::uint32_t f : shell.face) {
    const glm::dvec3 a = cornerOf(shells, f, 0), b = cornerOf(shells, f, 1), c = cornerOf(shells, f, 2);
    volume += glm::dot(a - origin, glm::cross(b - origin, c - origin)) / 6.0;
    area += 0.5 * glm::length(glm::cross(b - a, c - a));
    shell.low = glm::min(shell.low, glm::min(a, glm::min(b, c)));
    shell.high = glm::max(shell.high, glm::max(a, glm::max(b, c)));
  }
  return volume > kMinVolume * area * std::sqrt(area);
}

// Half done where the context is cancelled.
Shells findShells(const Scene& scene, const Group& meshes, const Context& context) {
  Shells shells;
  std::vector<std::uint8_t> open;
  listFaces(scene, meshes, shells, open);
  if (context.cancelled()) return {};
  const auto count = static_cast<std::uint32_t>(shells.face.size());
  Sets sets(count);
  joinFaces(shells, sets, open);
  if (context.cancelled()) return {};
  for (std::uint32_t f = 0; f < count; ++f) {
    if (open[f]) open[sets.root(f)] = 1;
  }
  std::vector<std::uint32_t> shellOfRoot(count, kNone);
  for (std::uint32_t f = 0; f < count; ++f) {
    const std::uint32_t root = sets.root(f);
    const auto& corner = shells.face[f].corner;
    if (open[root] || corner[0] == corner[1]) continue;
    if (shellOfRoot[root] == kNone) {
      shellOfRoot[root] = static_cast<std::uint32_t>(shells.shell.size());
      shells.shell.emplace_back();
    }
    shells.shell[shellOfRoot[root]].face.push_back(f);
  }
  std::erase_if(shells.shell, [&](Shell& shell) { return !measure(shells, shell); });
  shells.shellOf.assign(count, kNone);
  for (std::uint32_t s = 0; s < shells.shell.size(); ++s) {
    for (const std::uint32_t f : shells.shell[s].face) shells.shellOf[f] = s;
  }
  return shells;
}

// Whether a point is inside: the sum of the solid angles of all faces is 4 pi there, and 0 outside (Van Oosterom and
// Strackee 1983: tan(omega / 2) = a·(b×c) / (|a||b||c| + (a·b)|c| + (b·c)|a| + (c·a)|b|)).
bool isInsideByAngles(const Shells& shells, const Shell& shell, const glm::dvec3& p) {
  double half = 0.0;
  for (const std::uint32_t f : shell.face) {
    const glm::dvec3 a = cornerOf(shells, f, 0) - p, b = cornerOf(shells, f, 1) - p, c = cornerOf(shells, f, 2) - p;
    const double la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
    half += std::atan2(glm::dot(a, glm::cross(b, c)),
                       la * lb * lc + glm::dot(a, b) * lc + glm::dot(b, c) * la + glm::dot(c, a) * lb);
  }
  return half > 3.14159265;  // half of 2 pi
}

// The same by the faces that a ray leaves and enters through, which most faces are not; nothing where the ray meets an
// edge or begins at a face, within rounding. It goes up at a slant, to miss the edges of walls.
std::optional<bool> isInsideByRay(const Shells& shells, const Shell& shell, const glm::dvec3& p) {
  const double size = std::max({shell.high.x - shell.low.x, shell.high.y - shell.low.y, shell.high.z - shell.low.z});
  const double near = 1e-9 * size;
  // A corner as seen along the ray, which is +Y there.
  const auto seen = [&](std::uint32_t f, std::size_t k) {
    const glm::dvec3 v = cornerOf(shells, f, k) - p;
    return glm::dvec3(v.x - 0.31 * v.y, v.y, v.z - 0.17 * v.y);
  };
  int winding = 0;
  for (const std::uint32_t f : shell.face) {
    const std::array<glm::dvec3, 3> c = {seen(f, 0), seen(f, 1), seen(f, 2)};
    const auto [lowX, highX] = std::minmax({c[0].x, c[1].x, c[2].x});
    if (lowX > near || highX < -near) continue;
    const auto [lowZ, highZ] = std::minmax({c[0].z, c[1].z, c[2].z});
    if (lowZ > near || highZ < -near) continue;
    // Twice the areas of the ray's point with each edge, seen along the ray.
    std::array<double, 3> part{};
    for (std::size_t k = 0; k < 3; ++k) {
      const glm::dvec3 &from = c[(k + 1) % 3], &to = c[(k + 2) % 3];
      part[k] = from.z * to.x - from.x * to.z;
      const double length = std::hypot(to.x - from.x, to.z - from.z);
      if (std::abs(part[k]) <= near * length) return std::nullopt;
    }
    const bool up = part[0] > 0.0;
    if (up != (part[1] > 0.0) || up != (part[2] > 0.0)) continue;
    const double y = (part[0] * c[0].y + part[1] * c[1].y + part[2] * c[2].y) / (part[0] + part[1] + part[2]);
    if (!(std::abs(y) > near)) return std::nullopt;
    if (y > 0.0) winding += up ? 1 : -1;
  }
  return winding > 0;
}

bool isInside(const Shells& shells, const Shell& shell, const glm::dvec3& p) {
  if (glm::any(glm::lessThan(p, shell.low)) || glm::any(glm::greaterThan(p, shell.high))) return false;
  const std::optional<bool> byRay = isInsideByRay(shells, shell, p);
  return byRay ? *byRay : isInsideByAngles(shells, shell, p);
}

// What shows that a shell is a room: something that lies inside it, that is, more than a share of its points do.
struct Witness {
  std::vector<glm::dvec3> point;  // [m]
  double share = 0.0;
  std::uint32_t instance = kNone;  // kNone = no instance is meant
};

void addVolume(const PlayVolume& volume, std::vector<Witness>& witnesses) {
  Witness witness{{}, 0.5, kNone};
  for (std::uint32_t i = 0; i < kVolumePoints * kVolumePoints * kVolumePoints; ++i) {
    const glm::dvec3 cell(i % kVolumePoints, i / kVolumePoints % kVolumePoints, i / (kVolumePoints * kVolumePoints));
    witness.point.push_back(glm::dmat4(volume.toWorld) * glm::dvec4((cell + 0.5) / double{kVolumePoints} - 0.5, 1.0));
  }
  witnesses.push_back(std::move(witness));
}

// Objects that lie inside as a whole are meant to be seen there.
void addContents(const Scene& scene, std::uint32_t index, std::vector<Witness>& witnesses) {
  const Instance& instance = scene.instances[index];
  const Mesh& mesh = scene.meshes[instance.mesh];
  if (mesh.position.empty()) return;
  Witness witness{{}, 0.99, index};
  const std::size_t count = std::min(kContentPoints, mesh.position.size());
  for (std::size_t k = 0; k < count; ++k)
    witness.point.push_back(glm::dmat4(instance.toWorld) *
                            glm::dvec4(mesh.position[k * mesh.position.size() / count], 1.0));
  witnesses.push_back(std::move(witness));
}

// Cameras and play volumes, which say where receivers are; without any, what suggests it.
std::vector<Witness> findWitnesses(const Scene& scene) {
  std::vector<Witness> witnesses;
  for (const std::uint32_t c : scene.playSpaceCameras())
    witnesses.push_back({{glm::dvec3(scene.cameras[c].toWorld[3])}, 0.5, kNone});
  for (const PlayVolume& volume : scene.volumes) addVolume(volume, witnesses);
  if (witnesses.empty()) {
    for (const SceneLight& light : scene.lights) {
      if (light.kind != LightKind::directional) witnesses.push_back({{glm::dvec3(light.positionWorld)}, 0.5, kNone});
    }
    for (std::uint32_t i = 0; i < scene.instances.size(); ++i) addContents(scene, i, witnesses);
  }
  if (witnesses.size() > kMaxWitnesses) {
    for (std::size_t i = 0; i < kMaxWitnesses; ++i) witnesses[i] = witnesses[i * witnesses.size() / kMaxWitnesses];
    witnesses.resize(kMaxWitnesses);
  }
  return witnesses;
}

// Which shells of a node have a witness inside.
std::vector<std::uint8_t> findRooms(const Scene& scene, const Group& instances, const Shells& shells,
                                    std::span<const Witness> witnesses, const Context& context) {
  std::vector<std::uint8_t> room(shells.shell.size(), 0);
  const glm::dmat4 toWorld(scene.instances[instances[0]].toWorld);
  if (glm::determinant(toWorld) == 0.0) return room;
  const glm::dmat4 toObject = glm::inverse(toWorld);
  for (const Witness& witness : witnesses) {
    if (std::find(instances.begin(), instances.end(), witness.instance) != instances.end()) continue;
    std::vector<glm::dvec3> point;
    for (const glm::dvec3& p : witness.point) point.emplace_back(toObject * glm::dvec4(p, 1.0));
    for (std::size_t s = 0; s < room.size(); ++s) {
      if (room[s]) continue;
      std::size_t inside = 0;
      for (const glm::dvec3& p : point) {
        if (context.cancelled()) return room;
        inside += isInside(shells, shells.shell[s], p);
      }
      room[s] = static_cast<double>(inside) > witness.share * static_cast<double>(point.size());
    }
  }
  return room;
}

// The instances of each node that have a two-sided material somewhere, primitives in order.
std::vector<Group> twoSidedNodes(const Scene& scene) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, Group> nodes;
  for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
    const Instance& instance = scene.instances[i];
    if (instance.baked()) nodes[{instance.nodeIndex, instance.gpuInstance}].push_back(i);
  }
  std::vector<Group> groups;
  for (auto& [node, instances] : nodes) {
    const bool any = std::any_of(instances.begin(), instances.end(),
                                 [&](std::uint32_t i) { return scene.material(scene.instances[i]).doubleSided; });
    if (any) groups.push_back(std::move(instances));
  }
  return groups;
}

Group meshesOf(const Scene& scene, const Group& instances) {
  Group meshes;
  for (const std::uint32_t i : instances) meshes.push_back(scene.instances[i].mesh);
  return meshes;
}

}  // namespace

void findSolids(Scene& scene, Context& context) {
  scene.solid.clear();
  const std::vector<Group> nodes = twoSidedNodes(scene);
  if (nodes.empty()) return;

  // 1. Shells, once for all nodes that use the same meshes
  std::map<Group, std::uint32_t> number;
  std::vector<Group> unique;
  for (const Group& instances : nodes) {
    Group meshes = meshesOf(scene, instances);
    if (number.emplace(meshes, static_cast<std::uint32_t>(unique.size())).second) unique.push_back(std::move(meshes));
  }
  std::vector<Shells> shells(unique.size());
  parallelChunks(context, "", unique.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t u = begin; u < end; ++u) shells[u] = findShells(scene, unique[u], context);
  });
  if (context.cancelled()) return;

  // 2. What is inside them, node by node
  const std::vector<Witness> witnesses = findWitnesses(scene);
  std::vector<std::uint8_t> solid(scene.triangleCount(), 0);
  parallelChunks(context, "", nodes.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const Shells& found = shells[number.at(meshesOf(scene, nodes[n]))];
      if (found.shell.empty()) continue;
      const std::vector<std::uint8_t> room = findRooms(scene, nodes[n], found, witnesses, context);
      std::size_t face = 0;
      for (const std::uint32_t i : nodes[n]) {
        const Instance& instance = scene.instances[i];
        const bool twoSided = scene.material(instance).doubleSided;
        for (std::size_t t = 0; t < scene.meshes[instance.mesh].triangle.size(); ++t, ++face) {
          const std::uint32_t s = found.shellOf[face];
          solid[instance.firstTriangle + t] = twoSided && s != kNone && !room[s] ? 1 : 0;
        }
      }
    }
  });
  if (std::any_of(solid.begin(), solid.end(), [](std::uint8_t s) { return s != 0; })) scene.solid = std::move(solid);
}

}  // namespace relume
