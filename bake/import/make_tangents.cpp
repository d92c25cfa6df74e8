// SPDX-License-Identifier: MIT
// See make_tangents.h. glTF 2.0, Sections 3.7.2.1 and 3.9.3: x of the map is along growing u, y upward in the image,
// which is against growing v. MikkTSpace (Mikkelsen 2008) splits vertices where the sides of triangles differ; here
// corners hold tangents, so that nothing is split.
#include "bake/import/make_tangents.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <vector>

namespace relume {
namespace {

// What corners must share to share a tangent: bits of position, normal and coordinates, and the side.
using Key = std::array<std::uint32_t, 9>;

glm::vec3 unitOr(const glm::vec3& v, const glm::vec3& fallback) {
  const float length = glm::length(v);
  return length > 0.0f && std::isfinite(length) ? v / length : fallback;
}

glm::vec3 across(const glm::vec3& v, const glm::vec3& normal) { return v - normal * glm::dot(normal, v); }

// The angle of a triangle at its corner k [rad].
float angleAt(const std::array<glm::vec3, 3>& p, std::size_t k) {
  const glm::vec3 a = unitOr(p[(k + 1) % 3] - p[k], glm::vec3(0.0f)),
                  b = unitOr(p[(k + 2) % 3] - p[k], glm::vec3(0.0f));
  return std::acos(std::clamp(glm::dot(a, b), -1.0f, 1.0f));
}

// A triangle in object space and on the image.
struct Face {
  std::array<std::uint32_t, 3> vertex;
  std::array<glm::vec3, 3> position, normal;
  std::array<glm::vec2, 3> uv;
  glm::vec3 alongU{0.0f};  // unit direction of growing u; 0 = the coordinates have no area
  float side = 0.0f;       // 1 where cross(normal, alongU) is upward in the image, else -1
};

Face faceOf(const Mesh& mesh, std::size_t t, const TextureRef& map) {
  Face face{{mesh.triangle[t].x, mesh.triangle[t].y, mesh.triangle[t].z}, {}, {}, {}};
  const auto& m = map.transform;
  for (std::size_t k = 0; k < 3; ++k) {
    face.position[k] = mesh.position[face.vertex[k]];
    const glm::vec2 uv = mesh.uv[map.texcoord][face.vertex[k]];
    face.uv[k] = {m[0] * uv.x + m[1] * uv.y + m[2], m[3] * uv.x + m[4] * uv.y + m[5]};
  }
  const glm::vec3 p1 = face.position[1] - face.position[0], p2 = face.position[2] - face.position[0];
  const glm::vec3 flat = unitOr(glm::cross(p1, p2), glm::vec3(0.0f));
  for (std::size_t k = 0; k < 3; ++k) face.normal[k] = mesh.normal.empty() ? flat : mesh.normal[face.vertex[k]];

  // dP/du of the affine map from the image to the triangle, times the area on the image
  const glm::vec2 t1 = face.uv[1] - face.uv[0], t2 = face.uv[2] - face.uv[0];
  const float area = t1.x * t2.y - t1.y * t2.x;
  if (area == 0.0f || !std::isfinite(area)) return face;
  face.alongU = unitOr((area > 0.0f ? 1.0f : -1.0f) * (t2.y * p1 - t1.y * p2), glm::vec3(0.0f));
  // Counter-clockwise triangles are clockwise on an image whose v grows downward.
  face.side = area < 0.0f ? 1.0f : -1.0f;
  return face;
}

Key keyOf(const Face& face, std::size_t k) {
  Key key{};
  for (int i = 0; i < 3; ++i) {
    key[static_cast<std::size_t>(i)] = std::bit_cast<std::uint32_t>(face.position[k][i]);
    key[static_cast<std::size_t>(3 + i)] = std::bit_cast<std::uint32_t>(face.normal[k][i]);
  }
  key[6] = std::bit_cast<std::uint32_t>(face.uv[k].x);
  key[7] = std::bit_cast<std::uint32_t>(face.uv[k].y);
  key[8] = face.side > 0.0f ? 1 : 0;
  return key;
}

glm::vec4 cornerTangent(const glm::vec3& tangent, const glm::vec3& normal, float side) {
  const glm::vec3 unit = unitOr(across(tangent, normal), glm::vec3(0.0f));
  return unit == glm::vec3(0.0f) ? glm::vec4(0.0f) : glm::vec4(unit, side);
}

}  // namespace

std::size_t makeTangents(Mesh& mesh, std::span<const glm::vec4> given, const TextureRef& map) {
  mesh.cornerTangent.assign(3 * mesh.triangle.size(), glm::vec4(0.0f));
  if (mesh.uv[map.texcoord].empty()) return mesh.triangle.size();
  const auto countBroken = [&] {
    std::size_t broken = 0;
    for (std::size_t t = 0; t < mesh.triangle.size(); ++t) broken += mesh.cornerTangent[3 * t].w == 0.0f;
    return broken;
  };
  if (!given.empty() && !mesh.normal.empty()) {
    for (std::size_t t = 0; t < mesh.triangle.size(); ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t v = mesh.triangle[t][static_cast<int>(k)];
        mesh.cornerTangent[3 * t + k] =
            cornerTangent(glm::vec3(given[v]), mesh.normal[v], given[v].w < 0.0f ? -1.0f : 1.0f);
      }
    }
    return countBroken();
  }
  std::map<Key, glm::vec3> sums;
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t) {
    const Face face = faceOf(mesh, t, map);
    if (face.side == 0.0f) continue;
    for (std::size_t k = 0; k < 3; ++k)
      sums[keyOf(face, k)] += angleAt(face.position, k) * unitOr(across(face.alongU, face.normal[k]), glm::vec3(0.0f));
  }
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t) {
    const Face face = faceOf(mesh, t, map);
    if (face.side == 0.0f) continue;
    for (std::size_t k = 0; k < 3; ++k)
      mesh.cornerTangent[3 * t + k] = cornerTangent(sums[keyOf(face, k)], face.normal[k], face.side);
  }
  return countBroken();
}

}  // namespace relume
