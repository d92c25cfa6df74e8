// SPDX-License-Identifier: MIT
// Material values at a point of a surface: base colour factor x texture x vertex colour, emission, alpha test.
// Textures are 8-bit sRGB, decoded by table; a footprint in metres becomes a mip level by the triangle's texel density.
#include "formats/color.h"
#include "relume/bake/scene.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <array>
#include <cmath>

namespace relume {
namespace {

using SrgbTable = std::array<float, 256>;

const SrgbTable& srgbTable() {
  static const SrgbTable kTable = [] {
    SrgbTable table{};
    for (std::size_t i = 0; i < table.size(); ++i) table[i] = srgbToLinear(static_cast<float>(i) / 255.0f);
    return table;
  }();
  return kTable;
}

// A point of a surface, with what all lookups need.
struct Lookup {
  const Instance& instance;
  const Mesh& mesh;
  glm::uvec3 vertex;  // in the order of Scene::corners()
  glm::vec3 weight;
};

Lookup lookUp(const Scene& scene, const SurfacePoint& p) {
  const Instance& instance = scene.instances[p.instance];
  const Mesh& mesh = scene.meshes[instance.mesh];
  const glm::uvec3 v = mesh.triangle[p.triangle];
  return {instance,
          mesh,
          instance.flipped ? glm::uvec3(v.x, v.z, v.y) : v,
          {1.0f - p.barycentric.x - p.barycentric.y, p.barycentric.x, p.barycentric.y}};
}

template <class T>
T interpolate(const std::vector<T>& values, const Lookup& at) {
  return at.weight.x * values[at.vertex.x] + at.weight.y * values[at.vertex.y] + at.weight.z * values[at.vertex.z];
}

// Mip level at which a texel is as wide as the footprint: log2(footprint x sqrt(texel area / world area)).
float mipLevel(const Scene& scene, const SurfacePoint& p, const Lookup& at, const TextureRef& texture,
               float footprintWorld) {
  const auto& uv = at.mesh.uv[texture.texcoord];
  const glm::vec2 a = uv[at.vertex.y] - uv[at.vertex.x];
  const glm::vec2 b = uv[at.vertex.z] - uv[at.vertex.x];
  const auto& t = texture.transform;
  const Image::Level& image = scene.images[texture.image].levels.front();
  const float texels = std::fabs((a.x * b.y - a.y * b.x) * (t[0] * t[4] - t[1] * t[3])) *
                       static_cast<float>(image.width) * static_cast<float>(image.height);
  const std::array<glm::vec3, 3> corner = scene.corners(at.instance, p.triangle);
  const float world = glm::length(glm::cross(corner[1] - corner[0], corner[2] - corner[0]));
  const float ratio = footprintWorld * footprintWorld * texels / world;
  return ratio > 1.0f && std::isfinite(ratio) ? 0.5f * std::log2(ratio) : 0.0f;
}

// Two neighbouring texels along one axis and the weight of the second.
struct Taps {
  std::uint32_t first, second;
  float weight;
};

Taps wrapTaps(float u, std::uint32_t size, Wrap wrap) {
  if (!(std::fabs(u) < 1e7f)) u = 0.0f;
  if (wrap == Wrap::repeat) u -= std::floor(u);
  if (wrap == Wrap::mirror) {
    u -= 2.0f * std::floor(0.5f * u);
    if (u > 1.0f) u = 2.0f - u;
  }
  const float x = glm::clamp(u, 0.0f, 1.0f) * static_cast<float>(size) - 0.5f;
  const float floorX = std::floor(x);
  const auto last = static_cast<std::int64_t>(size) - 1;
  auto first = static_cast<std::int64_t>(floorX), second = first + 1;
  const bool repeats = wrap == Wrap::repeat;
  if (first < 0) first = repeats ? last : 0;
  if (second > last) second = repeats ? 0 : last;
  return {static_cast<std::uint32_t>(std::min(first, last)), static_cast<std::uint32_t>(second), x - floorX};
}

// What is read from a texel: linear colour and alpha, or alpha alone, which rays need millions of times.
struct ColorAndAlpha {
  using Value = glm::vec4;
  static glm::vec4 read(const Image::Level& level, std::size_t texel) {
    if (!level.linear.empty()) return {level.linear[texel], 1.0f};
    const std::uint8_t* rgba = &level.rgba[4 * texel];
    const SrgbTable& linear = srgbTable();
    return {linear[rgba[0]], linear[rgba[1]], linear[rgba[2]], static_cast<float>(rgba[3]) * (1.0f / 255.0f)};
  }
};
// The numbers of a texture that is no colour.
struct Numbers {
  using Value = glm::vec3;
  static glm::vec3 read(const Image::Level& level, std::size_t texel) {
    const std::uint8_t* rgba = &level.rgba[4 * texel];
    return glm::vec3(rgba[0], rgba[1], rgba[2]) * (1.0f / 255.0f);
  }
};
struct Alpha {
  using Value = float;
  static float read(const Image::Level& level, std::size_t texel) {
    return static_cast<float>(level.rgba[4 * texel + 3]) * (1.0f / 255.0f);
  }
};

template <class Texel>
typename Texel::Value sampleLevel(const Image::Level& level, const TextureRef& texture, const glm::vec2& uv,
                                  bool nearest) {
  const auto texel = [&](std::uint32_t x, std::uint32_t y) {
    return Texel::read(level, static_cast<std::size_t>(y) * level.width + x);
  };
  const Taps x = wrapTaps(uv.x, level.width, texture.wrapU);
  const Taps y = wrapTaps(uv.y, level.height, texture.wrapV);
  if (nearest) return texel(x.weight < 0.5f ? x.first : x.second, y.weight < 0.5f ? y.first : y.second);
  const auto top = glm::mix(texel(x.first, y.first), texel(x.second, y.first), x.weight);
  const auto bottom = glm::mix(texel(x.first, y.second), texel(x.second, y.second), x.weight);
  return glm::mix(top, bottom, y.weight);
}

// The value of a texture slot at a point; all ones without a texture or without coordinates.
template <class Texel = ColorAndAlpha>
typename Texel::Value sampleTexture(const Scene& scene, const SurfacePoint& p, const Lookup& at,
                                    const TextureRef& texture, float footprintWorld) {
  if (texture.image == kNone || at.mesh.uv[texture.texcoord].empty()) return typename Texel::Value(1.0f);
  const glm::vec2 uv = interpolate(at.mesh.uv[texture.texcoord], at);
  const auto& t = texture.transform;
  const glm::vec2 st(t[0] * uv.x + t[1] * uv.y + t[2], t[3] * uv.x + t[4] * uv.y + t[5]);

  const std::vector<Image::Level>& levels = scene.images[texture.image].levels;
  const float lod = footprintWorld > 0.0f ? mipLevel(scene, p, at, texture, footprintWorld) : 0.0f;
  const auto coarsest = static_cast<float>(levels.size() - 1);
  const float clamped = std::min(lod, coarsest);
  const auto lower = static_cast<std::size_t>(clamped);
  const float fraction = clamped - static_cast<float>(lower);
  const auto fine = sampleLevel<Texel>(levels[lower], texture, st, texture.nearest && lod == 0.0f);
  if (fraction == 0.0f) return fine;
  return glm::mix(fine, sampleLevel<Texel>(levels[lower + 1], texture, st, false), fraction);
}

}  // namespace

glm::vec3 albedoAt(const Scene& scene, const SurfacePoint& p, float footprintWorld) {
  const Lookup at = lookUp(scene, p);
  const Material& material = scene.material(at.instance);
  glm::vec3 albedo = material.albedo * glm::vec3(sampleTexture(scene, p, at, material.albedoTexture, footprintWorld));
  if (!at.mesh.color.empty()) albedo *= interpolate(at.mesh.color, at);
  return glm::clamp(albedo, 0.0f, 1.0f);
}

glm::vec3 emissionAt(const Scene& scene, const SurfacePoint& p, float footprintWorld) {
  const Lookup at = lookUp(scene, p);
  const Material& material = scene.material(at.instance);
  if (material.emission == glm::vec3(0.0f)) return glm::vec3(0.0f);
  return material.emission * glm::vec3(sampleTexture(scene, p, at, material.emissionTexture, footprintWorld));
}

bool opaqueAt(const Scene& scene, const SurfacePoint& p) {
  const Lookup at = lookUp(scene, p);
  const Material& material = scene.material(at.instance);
  if (material.alphaMode == AlphaMode::opaque) return true;
  float alpha = material.alpha * sampleTexture<Alpha>(scene, p, at, material.albedoTexture, 0.0f);
  if (!at.mesh.colorAlpha.empty()) alpha *= interpolate(at.mesh.colorAlpha, at);
  return alpha >= material.alphaCutoff;
}

SurfaceGloss glossAt(const Scene& scene, const SurfacePoint& p) {
  const Lookup at = lookUp(scene, p);
  const MaterialGloss& gloss = scene.material(at.instance).gloss;
  const glm::vec3 texel = sampleTexture<Numbers>(scene, p, at, gloss.texture, 0.0f);
  return {gloss.metalness * texel.b, gloss.roughness * texel.g};
}

glm::vec3 mappedNormal(const Scene& scene, const SurfacePoint& p) {
  const glm::vec3 normal = shadingNormal(scene, p);
  const Lookup at = lookUp(scene, p);
  const MaterialGloss& gloss = scene.material(at.instance).gloss;
  if (gloss.normalTexture.image == kNone || at.mesh.cornerTangent.empty() || normal == glm::vec3(0.0f)) return normal;

  // The tangent at the point, in the world and across the normal; the side of the map's y, which mirrored instances
  // turn.
  glm::vec4 tangent(0.0f);
  for (int k = 0; k < 3; ++k) {
    const int corner = at.instance.flipped ? (3 - k) % 3 : k;  // as glTF has it
    tangent += at.weight[k] * at.mesh.cornerTangent[3 * std::size_t{p.triangle} + static_cast<std::size_t>(corner)];
  }
  glm::vec3 x = glm::mat3(at.instance.toWorld) * glm::vec3(tangent);
  x -= normal * glm::dot(x, normal);
  const float length = glm::length(x);
  if (tangent.w == 0.0f || !(length > 0.0f) || !std::isfinite(length)) return normal;
  x /= length;
  const glm::vec3 y = glm::cross(normal, x) * ((tangent.w < 0.0f) != at.instance.flipped ? -1.0f : 1.0f);

  const glm::vec3 texel = 2.0f * sampleTexture<Numbers>(scene, p, at, gloss.normalTexture, 0.0f) - 1.0f;
  const glm::vec3 bent = gloss.normalScale * (texel.x * x + texel.y * y) + texel.z * normal;
  const float size = glm::length(bent);
  return size > 0.0f && std::isfinite(size) ? bent / size : normal;
}

}  // namespace relume
