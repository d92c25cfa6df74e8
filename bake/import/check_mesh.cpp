// SPDX-License-Identifier: MIT
// Finds what is wrong with meshes. Coinciding corners are merged, and faces are joined over edges that have two of
// them. That shows non-manifold edges, and faces whose winding disagrees with their neighbours'. CGAL's exact predicate
// finds slivers; values are checked before, because it asserts that they are finite.
#include "bake/import/check_mesh.h"

#include "bake/base/cancellable_sort.h"
#include "bake/base/parallel.h"
#include "relume/bake/context.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <functional>
#include <numeric>
#include <optional>

namespace relume {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Face = std::array<std::uint32_t, 3>;  // merged corners, each named by the first vertex at its position

// Faces by merged corners; degenerate and duplicate ones are left out of `faces`.
struct Soup {
  std::vector<Face> faces;
  std::vector<std::uint32_t> triangle;  // of each face, in the mesh
};

// How many of a kind, and the first.
struct Tally {
  std::uint32_t count = 0;
  std::uint32_t first = kNone;
  void add(std::uint32_t triangle) {
    ++count;
    first = std::min(first, triangle);
  }
};

struct Findings {
  Tally degenerate, duplicate, nonManifold, border, flipped;
};

bool finite(const glm::vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

bool usable(const Mesh& mesh, const glm::uvec3& t) {
  for (const std::uint32_t v : {t.x, t.y, t.z}) {
    if (v >= mesh.position.size() || !finite(mesh.position[v])) return false;
  }
  return true;
}

// The first vertex at each vertex's position. Negative zero equals zero. Incomplete when cancelled.
std::vector<std::uint32_t> mergePositions(const Mesh& mesh, const Context& context) {
  const auto key = [&](std::uint32_t v) {
    const glm::vec3 p = mesh.position[v] + 0.0f;
    return std::array<float, 3>{p.x, p.y, p.z};
  };
  std::vector<std::uint32_t> order;
  for (std::uint32_t v = 0; v < mesh.position.size(); ++v) {
    if (finite(mesh.position[v])) order.push_back(v);
  }
  const auto before = [&](std::uint32_t a, std::uint32_t b) {
    const auto ka = key(a), kb = key(b);
    return ka != kb ? ka < kb : a < b;
  };
  std::vector<std::uint32_t> merged(mesh.position.size(), kNone);
  if (!sortUnlessCancelled(order, before, context)) return merged;
  for (std::size_t i = 0; i < order.size(); ++i)
    merged[order[i]] = i > 0 && key(order[i]) == key(order[i - 1]) ? merged[order[i - 1]] : order[i];
  return merged;
}

// Zero area within the rounding of its corners' coordinates: the height over the longest edge is below four steps of
// the largest coordinate, or the corners are exactly collinear.
bool degenerate(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
  const glm::dvec3 ab = glm::dvec3(b) - glm::dvec3(a), ac = glm::dvec3(c) - glm::dvec3(a);
  const double longest = std::sqrt(std::max({glm::dot(ab, ab), glm::dot(ac, ac), glm::dot(ac - ab, ac - ab)}));
  const double twiceArea = glm::length(glm::cross(ab, ac));
  double largest = 0.0;
  for (const glm::vec3& p : {a, b, c})
    largest = std::max({largest, std::fabs(static_cast<double>(p.x)), std::fabs(static_cast<double>(p.y)),
                        std::fabs(static_cast<double>(p.z))});
  if (twiceArea <= longest * largest * 4.0 * 0x1p-24) return true;
  return CGAL::collinear(Point(a.x, a.y, a.z), Point(b.x, b.y, b.z), Point(c.x, c.y, c.z));
}

// Merge corners and sort out the faces that no further test can use. Incomplete when cancelled.
Soup makeSoup(const Mesh& mesh, Findings& found, const Context& context) {
  const std::vector<std::uint32_t> merged = mergePositions(mesh, context);
  Soup soup;
  std::vector<std::pair<Face, std::uint32_t>> faces;  // sorted corners, triangle
  std::vector<Face> wound(mesh.triangle.size());
  for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {
    if (context.cancelled()) return soup;
    const glm::uvec3 v = mesh.triangle[t];
    if (!usable(mesh, v) || degenerate(mesh.position[v.x], mesh.position[v.y], mesh.position[v.z])) {
      found.degenerate.add(t);
      continue;
    }
    wound[t] = {merged[v.x], merged[v.y], merged[v.z]};
    Face corners = wound[t];
    std::sort(corners.begin(), corners.end());
    faces.emplace_back(corners, t);
  }
  if (!sortUnlessCancelled(faces, std::less<>(), context)) return soup;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    if (i > 0 && faces[i].first == faces[i - 1].first) {
      found.duplicate.add(faces[i].second);
    } else {
      soup.triangle.push_back(faces[i].second);
    }
  }
  std::sort(soup.triangle.begin(), soup.triangle.end());
  for (const std::uint32_t t : soup.triangle) soup.faces.push_back(wound[t]);
  return soup;
}

struct Edge {
  std::uint32_t low, high;
  std::uint32_t face;
  bool upwards;  // the face goes from low to high
  bool operator<(const Edge& o) const {
    return low != o.low ? low < o.low : high != o.high ? high < o.high : face < o.face;
  }
  bool sameEnds(const Edge& o) const { return low == o.low && high == o.high; }
};

// Components of joined faces. For each face, whether its winding disagrees with that of its component's first face: a
// union-find whose links carry that bit.
class Components {
 public:
  explicit Components(std::size_t faces) : up_(faces), turned_(faces, 0) { std::iota(up_.begin(), up_.end(), 0u); }

  struct Root {
    std::uint32_t first;  // face of the component
    std::uint8_t turned;  // 1 = winding disagrees with it
  };
  Root find(std::uint32_t face) {
    std::uint8_t turned = 0;
    while (up_[face] != face) {
      const std::uint32_t parent = up_[face];
      turned_[face] ^= turned_[parent];
      up_[face] = up_[parent];
      turned ^= turned_[face];
      face = up_[face];
    }
    return {face, turned};
  }
  // In a surface that cannot be oriented, such as a Moebius strip, what was joined first counts.
  void join(std::uint32_t a, std::uint32_t b, bool disagree) {
    const Root rootA = find(a), rootB = find(b);
    if (rootA.first == rootB.first) return;
    const std::uint32_t later = std::max(rootA.first, rootB.first);
    up_[later] = std::min(rootA.first, rootB.first);
    turned_[later] = rootA.turned ^ rootB.turned ^ static_cast<std::uint8_t>(disagree);
  }

 private:
  std::vector<std::uint32_t> up_;
  std::vector<std::uint8_t> turned_;
};

// Join faces over edges that have exactly two of them. Notes borders and non-manifold edges on the way. Incomplete when
// cancelled.
Components joinFaces(const Soup& soup, Findings& found, const Context& context) {
  std::vector<Edge> edges;
  edges.reserve(3 * soup.faces.size());
  for (std::uint32_t f = 0; f < soup.faces.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = soup.faces[f][k], b = soup.faces[f][(k + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), f, a < b});
    }
  }
  Components components(soup.faces.size());
  if (!sortUnlessCancelled(edges, std::less<>(), context)) return components;
  for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    while (end < edges.size() && edges[end].sameEnds(edges[begin])) ++end;
    const Edge &first = edges[begin], &last = edges[end - 1];
    if (end - begin == 1) found.border.add(soup.triangle[first.face]);
    if (end - begin == 2) components.join(first.face, last.face, first.upwards == last.upwards);
    if (end - begin > 2) found.nonManifold.add(soup.triangle[first.face]);
  }
  return components;
}

double area(const Mesh& mesh, const glm::uvec3& t) {
  const glm::dvec3 a(mesh.position[t.x]), b(mesh.position[t.y]), c(mesh.position[t.z]);
  return 0.5 * glm::length(glm::cross(b - a, c - a));
}

// Whether a triangle's front faces away from the mean of its vertex normals.
bool againstNormals(const Mesh& mesh, const glm::uvec3& t) {
  if (mesh.normal.empty()) return false;
  const glm::vec3 face = glm::cross(mesh.position[t.y] - mesh.position[t.x], mesh.position[t.z] - mesh.position[t.x]);
  return glm::dot(face, mesh.normal[t.x] + mesh.normal[t.y] + mesh.normal[t.z]) < 0.0f;
}

// Find non-manifold edges, and flipped faces: those that disagree with most of their component's area, or that face
// away from their own normals.
void findOrientation(const Mesh& mesh, const Soup& soup, Findings& found, const Context& context) {
  Components components = joinFaces(soup, found, context);
  if (context.cancelled()) return;
  std::vector<double> turned(soup.faces.size(), 0.0), kept(soup.faces.size(), 0.0);
  for (std::uint32_t f = 0; f < soup.faces.size(); ++f) {
    const Components::Root root = components.find(f);
    (root.turned ? turned : kept)[root.first] += area(mesh, mesh.triangle[soup.triangle[f]]);
  }
  for (std::uint32_t f = 0; f < soup.faces.size(); ++f) {
    const Components::Root root = components.find(f);
    const double same = kept[root.first], against = turned[root.first];
    const bool minority = (root.turned != 0) == (against <= same) && against > 0.0 && same > 0.0;
    if (minority || againstNormals(mesh, mesh.triangle[soup.triangle[f]])) found.flipped.add(soup.triangle[f]);
  }
}

Findings checkMesh(const Mesh& mesh, const Context& context) {
  Findings found;
  const Soup soup = makeSoup(mesh, found, context);
  if (!context.cancelled()) findOrientation(mesh, soup, found, context);
  return found;
}

// Collapse all but the first of triangles with the same corners in the same cyclic order. Where an alpha mask shows
// different parts of them, their texture coordinates must agree too.
Tally collapseDuplicates(Mesh& mesh, bool masked, const Context& context) {
  struct Wound {
    std::array<std::uint32_t, 3> corners;  // merged, the least first
    std::uint32_t triangle;
    std::array<std::uint32_t, 3> vertices;  // in the same order
  };
  const std::vector<std::uint32_t> merged = mergePositions(mesh, context);
  std::vector<Wound> faces;
  for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {
    const glm::uvec3 v = mesh.triangle[t];
    if (!usable(mesh, v)) continue;
    Wound face{{merged[v.x], merged[v.y], merged[v.z]}, t, {v.x, v.y, v.z}};
    if (face.corners[0] == face.corners[1] || face.corners[1] == face.corners[2] || face.corners[2] == face.corners[0])
      continue;
    const auto min = std::min_element(face.corners.begin(), face.corners.end()) - face.corners.begin();
    std::rotate(face.vertices.begin(), face.vertices.begin() + min, face.vertices.end());
    std::rotate(face.corners.begin(), face.corners.begin() + min, face.corners.end());
    faces.push_back(face);
  }
  const auto before = [](const Wound& a, const Wound& b) {
    return a.corners != b.corners ? a.corners < b.corners : a.triangle < b.triangle;
  };
  Tally collapsed;
  if (!sortUnlessCancelled(faces, before, context)) return collapsed;
  for (std::size_t i = 1, first = 0; i < faces.size(); ++i) {
    if (faces[i].corners != faces[first].corners) first = i;
    if (first == i) continue;
    bool same = true;
    for (std::size_t k = 0; masked && k < 3; ++k) {
      const std::uint32_t a = faces[first].vertices[k], b = faces[i].vertices[k];
      for (const auto& uv : mesh.uv) same &= uv.empty() || uv[a] == uv[b];
    }
    if (!same) continue;
    glm::uvec3& triangle = mesh.triangle[faces[i].triangle];
    triangle = glm::uvec3(triangle.x);
    collapsed.add(faces[i].triangle);
  }
  return collapsed;
}

// A node that uses each mesh; empty for a mesh nobody uses.
std::vector<std::string> nodesOfMeshes(const Scene& scene) {
  std::vector<std::string> node(scene.meshes.size());
  for (auto instance = scene.instances.rbegin(); instance != scene.instances.rend(); ++instance)
    node[instance->mesh] = instance->node;
  return node;
}

}  // namespace

const char* toString(MeshFinding::Kind kind) {
  switch (kind) {
    case MeshFinding::Kind::degenerateTriangle:
      return "degenerate triangle";
    case MeshFinding::Kind::duplicateTriangle:
      return "duplicate triangle";
    case MeshFinding::Kind::nonManifoldEdge:
      return "non-manifold edge";
    case MeshFinding::Kind::openBorder:
      return "open border edge";
    case MeshFinding::Kind::flippedWinding:
      return "flipped winding";
    case MeshFinding::Kind::repaired:
      return "repaired triangle";
  }
  return "";
}

std::vector<MeshFinding> checkMeshes(const Scene& scene, Context& context) {
  const Context::Stage stage(context, "check meshes");
  std::vector<Findings> found(scene.meshes.size());
  std::vector<std::optional<std::string>> failed(scene.meshes.size());
  parallelChunks(context, "check meshes", scene.meshes.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t m = begin; m < end; ++m) {
      try {
        found[m] = checkMesh(scene.meshes[m], context);
      } catch (const std::bad_alloc&) {
        throw;  // not an error of the mesh
      } catch (const std::exception& e) {
        failed[m] = e.what();
      }
    }
  });

  std::vector<MeshFinding> out;
  const std::vector<std::string> node = nodesOfMeshes(scene);
  for (std::uint32_t m = 0; m < found.size(); ++m) {
    if (failed[m])
      context.message(Severity::warning,
                      "mesh '" + scene.meshes[m].name +
                          "' could not be checked and is baked as it is; look for broken triangles in node \"" +
                          node[m] + "\": " + *failed[m]);
    const auto note = [&](MeshFinding::Kind kind, const Tally& tally) {
      if (tally.count > 0) out.push_back({kind, m, tally.count, tally.first, node[m]});
    };
    note(MeshFinding::Kind::degenerateTriangle, found[m].degenerate);
    note(MeshFinding::Kind::duplicateTriangle, found[m].duplicate);
    note(MeshFinding::Kind::nonManifoldEdge, found[m].nonManifold);
    note(MeshFinding::Kind::openBorder, found[m].border);
    note(MeshFinding::Kind::flippedWinding, found[m].flipped);
  }
  return out;
}

std::vector<MeshFinding> repairMeshes(Scene& scene, Context& context) {
  std::vector<Tally> repaired(scene.meshes.size());
  parallelChunks(context, "repair meshes", scene.meshes.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t m = begin; m < end; ++m) {
      Mesh& mesh = scene.meshes[m];
      const bool masked = mesh.material != kNone && scene.materials[mesh.material].alphaMode == AlphaMode::mask;
      repaired[m] = collapseDuplicates(mesh, masked, context);
    }
  });
  std::vector<MeshFinding> out;
  const std::vector<std::string> node = nodesOfMeshes(scene);
  for (std::uint32_t m = 0; m < repaired.size(); ++m) {
    if (repaired[m].count > 0)
      out.push_back({MeshFinding::Kind::repaired, m, repaired[m].count, repaired[m].first, node[m]});
  }
  return out;
}

}  // namespace relume
