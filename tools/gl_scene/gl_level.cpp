// SPDX-License-Identifier: MIT
// See gl_level.h.
#include "tools/gl_scene/gl_level.h"

#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/mat3x3.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <tuple>

namespace relume {
namespace {

struct Vertex {
  glm::vec3 position;  // [m] world
  glm::vec3 normal;    // world, not unit: interpolated as glTF asks
  glm::vec2 uvAlbedo, uvEmission;
  std::uint32_t lightmapUv[2];  // packUnorm16x2 or kGridLit, of the front and of the back
};
static_assert(sizeof(Vertex) == 48);

// What normal maps and textures of roughness need in addition, of a level that has some.
struct GlossVertex {
  glm::vec4 tangent;  // world, not unit; w: side of the map's y, 0 = no map here
  glm::vec2 uvGloss, uvNormal;
};
static_assert(sizeof(GlossVertex) == 32);

// Of a level with vertex colours. The places of attributes past those of Vertex and GlossVertex.
using ColorVertex = glm::vec4;  // linear factors of colour and alpha
constexpr GLuint kColorSlot = 8;

enum Uniform : GLint {
  kClip = 0,
  kMoved = 1,
  kAlbedo = 2,
  kEmission = 3,
  kCutoff = 4,
  kDoubleSided = 5,
  kGloss = 6,
  kIsEdited = 7,
  kOrigin = 8
};

glm::vec2 textureUv(const Mesh& mesh, const TextureRef& texture, std::uint32_t vertex) {
  if (texture.image == kNone || mesh.uv[texture.texcoord].empty()) return glm::vec2(0.0f);
  const glm::vec2 uv = mesh.uv[texture.texcoord][vertex];
  const auto& t = texture.transform;
  return {t[0] * uv.x + t[1] * uv.y + t[2], t[3] * uv.x + t[4] * uv.y + t[5]};
}

// Corner of a triangle, in glTF order, on the light map of its front (0) or back (1).
std::uint32_t lightmapCorner(const Lightmap* map, std::uint32_t instance, std::uint32_t triangle, std::uint32_t k,
                             int side) {
  if (!map || instance >= map->parts.size() || triangle >= map->parts[instance].triangleCount) return kGridLit;
  const std::uint64_t corner = map->parts[instance].firstCorner + 3ull * triangle + k;
  const Array<std::uint32_t>& uv = side == 0 ? map->cornerUv : map->backCornerUv;
  return corner < uv.size() ? uv[corner] : kGridLit;
}

// Calls visit(k, c, triangle, vertex) for the corners of an instance in the order of the vertex buffer: k-th of the
// triangle in the world, c-th as glTF has it.
template <class Visit>
void forEachCorner(const Mesh& mesh, bool flipped, const Visit& visit) {
  for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t c = flipped ? (3 - k) % 3 : k;
      visit(k, c, t, mesh.triangle[t][static_cast<int>(c)]);
    }
  }
}

void appendInstance(const Scene& scene, std::uint32_t index, const Lightmap* map, std::vector<Vertex>& out) {
  const Instance& instance = scene.instances[index];
  const Mesh& mesh = scene.meshes[instance.mesh];
  const Material& material = scene.material(instance);
  const glm::mat3 m(instance.toWorld);
  const float sign = instance.flipped ? -1.0f : 1.0f;
  const glm::mat3 normalToWorld(sign * glm::cross(m[1], m[2]), sign * glm::cross(m[2], m[0]),
                                sign * glm::cross(m[0], m[1]));
  std::array<glm::vec3, 3> corners;
  glm::vec3 face(0.0f);
  forEachCorner(mesh, instance.flipped, [&](std::uint32_t k, std::uint32_t c, std::uint32_t t, std::uint32_t v) {
    if (k == 0) {
      corners = scene.corners(instance, t);
      face = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
    }
    glm::vec3 normal = mesh.normal.empty() ? face : normalToWorld * mesh.normal[v];
    const float length = glm::length(normal);
    if (length > 0.0f) normal /= length;
    out.push_back({corners[k],
                   normal,
                   textureUv(mesh, material.albedoTexture, v),
                   textureUv(mesh, material.emissionTexture, v),
                   {lightmapCorner(map, index, t, c, 0), lightmapCorner(map, index, t, c, 1)}});
  });
}

void appendGloss(const Scene& scene, const Instance& instance, std::vector<GlossVertex>& out) {
  const Mesh& mesh = scene.meshes[instance.mesh];
  const MaterialGloss& gloss = scene.material(instance).gloss;
  const glm::mat3 toWorld(instance.toWorld);
  const float side = instance.flipped ? -1.0f : 1.0f;
  forEachCorner(mesh, instance.flipped, [&](std::uint32_t, std::uint32_t c, std::uint32_t t, std::uint32_t v) {
    const glm::vec4 tangent = mesh.cornerTangent.empty() ? glm::vec4(0.0f) : mesh.cornerTangent[3 * std::size_t{t} + c];
    out.push_back({glm::vec4(toWorld * glm::vec3(tangent), side * tangent.w), textureUv(mesh, gloss.texture, v),
                   textureUv(mesh, gloss.normalTexture, v)});
  });
}

// The same of vertex colours: white where the mesh has none.
void appendColors(const Scene& scene, const Instance& instance, std::vector<ColorVertex>& out) {
  const Mesh& mesh = scene.meshes[instance.mesh];
  forEachCorner(mesh, instance.flipped, [&](std::uint32_t, std::uint32_t, std::uint32_t, std::uint32_t v) {
    out.emplace_back(mesh.color.empty() ? glm::vec3(1.0f) : mesh.color[v],
                     mesh.colorAlpha.empty() ? 1.0f : mesh.colorAlpha[v]);
  });
}

bool hasColors(const Scene& scene) {
  return std::any_of(scene.meshes.begin(), scene.meshes.end(),
                     [](const Mesh& mesh) { return !mesh.color.empty() || !mesh.colorAlpha.empty(); });
}

bool hasNumbers(const Scene& scene) {
  return std::any_of(scene.images.begin(), scene.images.end(), [](const Image& image) { return !image.isColor; });
}

GlTexture uploadImage(const Image& image) {
  GlTexture texture = GlTexture::make();
  glBindTexture(GL_TEXTURE_2D, texture.name());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  for (std::size_t level = 0; level < image.levels.size(); ++level) {
    const Image::Level& l = image.levels[level];
    if (!l.linear.empty()) {
      glTexImage2D(GL_TEXTURE_2D, static_cast<GLint>(level), GL_RGB32F, static_cast<GLsizei>(l.width),
                   static_cast<GLsizei>(l.height), 0, GL_RGB, GL_FLOAT, l.linear.data());
      continue;
    }
    glTexImage2D(GL_TEXTURE_2D, static_cast<GLint>(level), image.isColor ? GL_SRGB8_ALPHA8 : GL_RGBA8,
                 static_cast<GLsizei>(l.width), static_cast<GLsizei>(l.height), 0, GL_RGBA, GL_UNSIGNED_BYTE,
                 l.rgba.data());
  }
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, static_cast<GLint>(image.levels.size()) - 1);
  return texture;
}

GlTexture uploadWhite() {
  Image white;
  white.levels.push_back({1, 1, {255, 255, 255, 255}, {}});
  return uploadImage(white);
}

std::vector<GlSampler> makeSamplers() {
  constexpr std::array<GLint, 3> kWrap{GL_REPEAT, GL_MIRRORED_REPEAT, GL_CLAMP_TO_EDGE};
  std::vector<GlSampler> samplers;
  for (int i = 0; i < 18; ++i) {
    const bool nearest = i >= 9;
    GlSampler sampler = GlSampler::make();
    glSamplerParameteri(sampler.name(), GL_TEXTURE_WRAP_S, kWrap[static_cast<std::size_t>(i % 3)]);
    glSamplerParameteri(sampler.name(), GL_TEXTURE_WRAP_T, kWrap[static_cast<std::size_t>(i / 3 % 3)]);
    glSamplerParameteri(sampler.name(), GL_TEXTURE_MAG_FILTER, nearest ? GL_NEAREST : GL_LINEAR);
    glSamplerParameteri(sampler.name(), GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    samplers.push_back(std::move(sampler));
  }
  return samplers;
}

template <class Element>
GlBuffer uploadElements(const std::vector<Element>& elements) {
  GlBuffer buffer = GlBuffer::make();
  glBindBuffer(GL_ARRAY_BUFFER, buffer.name());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(elements.size() * sizeof(Element)), elements.data(),
               GL_STATIC_DRAW);
  return buffer;
}

GlVertexArray describeVertices(const GlBuffer& vertices, const GlBuffer* gloss, const GlBuffer* colors) {
  GlVertexArray layout = GlVertexArray::make();
  glBindVertexArray(layout.name());
  glBindBuffer(GL_ARRAY_BUFFER, vertices.name());
  const auto floats = [](GLuint slot, GLint count, std::size_t offset, std::size_t stride = sizeof(Vertex)) {
    glEnableVertexAttribArray(slot);
    glVertexAttribPointer(slot, count, GL_FLOAT, GL_FALSE, static_cast<GLsizei>(stride),
                          reinterpret_cast<const void*>(offset));
  };
  floats(0, 3, offsetof(Vertex, position));
  floats(1, 3, offsetof(Vertex, normal));
  floats(2, 2, offsetof(Vertex, uvAlbedo));
  floats(3, 2, offsetof(Vertex, uvEmission));
  glEnableVertexAttribArray(4);
  glVertexAttribIPointer(4, 2, GL_UNSIGNED_INT, sizeof(Vertex),
                         reinterpret_cast<const void*>(offsetof(Vertex, lightmapUv)));
  if (gloss) {
    glBindBuffer(GL_ARRAY_BUFFER, gloss->name());
    floats(5, 4, offsetof(GlossVertex, tangent), sizeof(GlossVertex));
    floats(6, 2, offsetof(GlossVertex, uvGloss), sizeof(GlossVertex));
    floats(7, 2, offsetof(GlossVertex, uvNormal), sizeof(GlossVertex));
  }
  if (colors) {
    glBindBuffer(GL_ARRAY_BUFFER, colors->name());
    floats(kColorSlot, 4, 0, sizeof(ColorVertex));
  }
  glBindVertexArray(0);
  glBindBuffer(GL_ARRAY_BUFFER, 0);
  return layout;
}

// Box around the instances' vertices in the world.
glm::vec3 centreOf(const Scene& scene, std::uint32_t first, std::uint32_t count) {
  glm::vec3 low(std::numeric_limits<float>::max()), high = -low;
  for (std::uint32_t i = first; i < first + count; ++i) {
    const Instance& instance = scene.instances[i];
    for (const glm::vec3& p : scene.meshes[instance.mesh].position) {
      const glm::vec3 world(instance.toWorld * glm::vec4(p, 1.0f));
      low = glm::min(low, world);
      high = glm::max(high, world);
    }
  }
  return low.x <= high.x ? 0.5f * low + 0.5f * high : glm::vec3(scene.instances[first].toWorld[3]);
}

// Index into movingNodes() of each instance; kNone of those that stand still.
std::vector<std::uint32_t> movingOf(const Scene& scene, const std::vector<MovingNode>& nodes) {
  std::vector<std::uint32_t> moving(scene.instances.size(), kNone);
  for (std::uint32_t k = 0; k < nodes.size(); ++k)
    std::fill_n(moving.begin() + nodes[k].firstInstance, nodes[k].instanceCount, k);
  return moving;
}

}  // namespace

std::vector<MovingNode> movingNodes(const Scene& scene, Movable movable) {
  std::vector<MovingNode> nodes;
  for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
    const Instance& instance = scene.instances[i];
    const bool moves =
        instance.mode == BakeMode::dynamic || (movable == Movable::all && instance.mode != BakeMode::ignore);
    if (!moves) continue;
    // A node's instances follow one another.
    const bool more = !nodes.empty() && nodes.back().firstInstance + nodes.back().instanceCount == i &&
                      scene.instances[i - 1].nodeIndex == instance.nodeIndex &&
                      scene.instances[i - 1].gpuInstance == instance.gpuInstance;
    if (!more) nodes.push_back({instance.node, i, 0, {}});
    ++nodes.back().instanceCount;
  }
  for (MovingNode& node : nodes) node.centreWorld = centreOf(scene, node.firstInstance, node.instanceCount);
  return nodes;
}

std::vector<glm::mat4> placedInstances(const Scene& scene, std::span<const MovingNode> nodes,
                                       std::span<const glm::mat4> moved) {
  std::vector<glm::mat4> toWorld;
  toWorld.reserve(scene.instances.size());
  for (const Instance& instance : scene.instances) toWorld.push_back(instance.toWorld);
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    for (std::uint32_t i = 0; i < nodes[k].instanceCount; ++i) {
      glm::mat4& to = toWorld[nodes[k].firstInstance + i];
      to = moved[k] * to;
    }
  }
  return toWorld;
}

Result<GlLevel> GlLevel::create(const Scene& scene, const Lightmap* lightmap, Movable movable,
                                std::span<const std::uint8_t> isEdited) {
  GlLevel level;
  level.materials_ = scene.materials;
  level.materials_.emplace_back();

  // Sort the instances by kind, what they move with, and material; a batch is a run of equal ones.
  const auto materialOf = [&](std::uint32_t i) {
    const std::uint32_t m = scene.meshes[scene.instances[i].mesh].material;
    return m == kNone ? static_cast<std::uint32_t>(scene.materials.size()) : m;
  };
  const auto editedOf = [&](std::uint32_t i) { return i < isEdited.size() && isEdited[i] != 0; };
  const std::vector<std::uint32_t> moving = movingOf(scene, movingNodes(scene, movable));
  std::vector<std::uint32_t> order;
  for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
    if (scene.instances[i].mode != BakeMode::ignore) order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::tuple(scene.instances[a].mode, editedOf(a), moving[a], materialOf(a)) <
           std::tuple(scene.instances[b].mode, editedOf(b), moving[b], materialOf(b));
  });

  // Un-indexed triangles: corners of different charts share no vertex anyway.
  std::vector<Vertex> vertices;
  std::vector<GlossVertex> glossVertices;
  std::vector<ColorVertex> colors;
  const bool numbers = hasNumbers(scene), colored = hasColors(scene);
  vertices.reserve(std::size_t{3} * scene.triangleCount());
  level.boundsMin_ = glm::vec3(std::numeric_limits<float>::max());
  level.boundsMax_ = -level.boundsMin_;
  for (const std::uint32_t i : order) {
    const std::uint32_t material = materialOf(i);
    const bool isBaked = scene.instances[i].baked();
    if (level.batches_.empty() || level.batches_.back().material != material ||
        level.batches_.back().moving != moving[i] || level.batches_.back().isBaked != isBaked ||
        level.batches_.back().isEdited != editedOf(i))
      level.batches_.push_back({static_cast<GLint>(vertices.size()), 0, material, moving[i], isBaked, editedOf(i)});
    const std::size_t first = vertices.size();
    appendInstance(scene, i, isBaked ? lightmap : nullptr, vertices);
    if (numbers) appendGloss(scene, scene.instances[i], glossVertices);
    if (colored) appendColors(scene, scene.instances[i], colors);
    level.batches_.back().vertexCount += static_cast<GLsizei>(vertices.size() - first);
    for (std::size_t v = first; v < vertices.size(); ++v) {
      level.boundsMin_ = glm::min(level.boundsMin_, vertices[v].position);
      level.boundsMax_ = glm::max(level.boundsMax_, vertices[v].position);
    }
  }
  level.triangleCount_ = static_cast<std::uint32_t>(vertices.size() / 3);

  // Upload
  while (glGetError() != GL_NO_ERROR) {
  }
  level.vertices_ = uploadElements(vertices);
  if (numbers) level.glossVertices_ = uploadElements(glossVertices);
  if (colored) level.colors_ = uploadElements(colors);
  level.layout_ =
      describeVertices(level.vertices_, numbers ? &level.glossVertices_ : nullptr, colored ? &level.colors_ : nullptr);
  for (const Image& image : scene.images)
    level.images_.push_back(image.levels.empty() ? uploadWhite() : uploadImage(image));
  level.white_ = uploadWhite();
  level.samplers_ = makeSamplers();
  glBindTexture(GL_TEXTURE_2D, 0);
  if (const GLenum error = glGetError(); error != GL_NO_ERROR) {
    return Error{ErrorCode::failed, "OpenGL error " + std::to_string(error) + " while uploading the level: " +
                                        std::to_string(vertices.size() * sizeof(Vertex)) + " bytes of vertices and " +
                                        std::to_string(scene.images.size()) + " images"};
  }
  return level;
}

void GlLevel::setEmission(std::uint32_t material, const glm::vec3& radiance, const TextureRef& texture) {
  materials_[material].emission = radiance;
  materials_[material].emissionTexture = texture;
}

void GlLevel::draw(const LevelView& view, bool gloss) const { drawBatches(view, {}, false, gloss); }

void GlLevel::drawDynamic(const LevelView& view, std::span<const glm::mat4> moved, bool gloss) const {
  drawBatches(view, moved, true, gloss);
}

void GlLevel::drawBatches(const LevelView& view, std::span<const glm::mat4> moved, bool dynamic, bool gloss) const {
  const glm::mat4 still(1.0f);
  glUniformMatrix4fv(kClip, 1, GL_FALSE, glm::value_ptr(view.clip));
  glUniform3fv(kOrigin, 1, glm::value_ptr(view.originWorld));
  glBindVertexArray(layout_.name());
  glVertexAttrib4f(kColorSlot, 1.0f, 1.0f, 1.0f, 1.0f);  // of a level without colours
  for (const Batch& batch : batches_) {
    if ((batch.moving != kNone) != dynamic || batch.vertexCount == 0) continue;
    const glm::mat4& at = batch.moving < moved.size() ? moved[batch.moving] : still;
    glUniformMatrix4fv(kMoved, 1, GL_FALSE, glm::value_ptr(at));
    glUniform1i(kIsEdited, batch.isEdited || (batch.isBaked && at != still) ? 1 : 0);
    bindMaterial(materials_[batch.material], gloss);
    glDrawArrays(GL_TRIANGLES, batch.firstVertex, batch.vertexCount);
  }
  glBindVertexArray(0);
  for (const int unit : kMaterialUnits) glBindSampler(static_cast<GLuint>(unit), 0);
}

void GlLevel::bindMaterial(const Material& material, bool gloss) const {
  glUniform4f(kAlbedo, material.albedo.r, material.albedo.g, material.albedo.b, material.alpha);
  glUniform3fv(kEmission, 1, glm::value_ptr(material.emission));
  glUniform1f(kCutoff, material.alphaMode == AlphaMode::mask ? material.alphaCutoff : -1.0f);
  glUniform1i(kDoubleSided, material.doubleSided ? 1 : 0);
  const bool isMapped = gloss && material.gloss.normalTexture.image < images_.size();
  glUniform4f(kGloss, material.gloss.metalness, material.gloss.roughness, material.gloss.normalScale,
              isMapped ? 1.0f : 0.0f);
  bindTexture(kMaterialUnits[0], material.albedoTexture);
  bindTexture(kMaterialUnits[1], material.emissionTexture);
  bindTexture(kMaterialUnits[2], material.gloss.texture);
  bindTexture(kMaterialUnits[3], material.gloss.normalTexture);
}

void GlLevel::bindTexture(int unit, const TextureRef& texture) const {
  const bool present = texture.image < images_.size();
  const int sampler = static_cast<int>(texture.wrapU) + 3 * static_cast<int>(texture.wrapV) + (texture.nearest ? 9 : 0);
  glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
  glBindTexture(GL_TEXTURE_2D, present ? images_[texture.image].name() : white_.name());
  glBindSampler(static_cast<GLuint>(unit), samplers_[static_cast<std::size_t>(sampler)].name());
  glActiveTexture(GL_TEXTURE0);
}

std::string levelVertexGlsl() {
  return R"(
layout(location = 0) in vec3 inPosition;
layout(location = 1) in vec3 inNormal;
layout(location = 2) in vec2 inUvAlbedo;
layout(location = 3) in vec2 inUvEmission;
layout(location = 4) in uvec2 inLightmapUv;
layout(location = 5) in vec4 inTangent;
layout(location = 6) in vec2 inUvGloss;
layout(location = 7) in vec2 inUvNormal;
layout(location = 8) in vec4 inColor;
layout(location = 0) uniform mat4 levelClip;
layout(location = 1) uniform mat4 levelMoved;
layout(location = 8) uniform vec3 levelOrigin;
invariant gl_Position;  // programs that draw the same level find the same depths
out vec3 levelPlace;
out vec3 levelVertexNormal;
out vec2 levelUvAlbedo;
out vec2 levelUvEmission;
out vec4 levelLightmapUv;
out vec4 levelTangent;
out vec4 levelUvGlossNormal;
out vec4 levelColor;
flat out uvec2 levelGridLit;
void levelVertex() {
  levelPlace = (levelMoved * vec4(inPosition, 1.0)).xyz - levelOrigin;
  levelVertexNormal = mat3(levelMoved) * inNormal;
  levelUvAlbedo = inUvAlbedo;
  levelUvEmission = inUvEmission;
  levelTangent = vec4(mat3(levelMoved) * inTangent.xyz, inTangent.w);
  levelUvGlossNormal = vec4(inUvGloss, inUvNormal);
  levelColor = inColor;
  levelLightmapUv = vec4(unpackUnorm2x16(inLightmapUv.x), unpackUnorm2x16(inLightmapUv.y));
  levelGridLit = uvec2(equal(inLightmapUv, uvec2(0xFFFFFFFFu)));
  gl_Position = levelClip * vec4(levelPlace, 1.0);
}
)";
}

std::string levelMaterialGlsl() {
  return R"(
in vec3 levelPlace;
in vec3 levelVertexNormal;
in vec2 levelUvAlbedo;
in vec2 levelUvEmission;
in vec4 levelLightmapUv;
in vec4 levelTangent;
in vec4 levelUvGlossNormal;
in vec4 levelColor;
flat in uvec2 levelGridLit;
layout(location = 0) uniform mat4 levelClip;
layout(location = 8) uniform vec3 levelOrigin;
layout(location = 2) uniform vec4 levelAlbedoFactor;
layout(location = 3) uniform vec3 levelEmissionFactor;
layout(location = 4) uniform float levelAlphaCutoff;
layout(location = 5) uniform bool levelDoubleSided;
layout(location = 7) uniform bool levelIsEdited;
layout(location = 6) uniform vec4 levelGlossFactor;  // metalness, roughness, scale of the normal map, whether there is one
layout(binding = 6) uniform sampler2D levelGlossTexture;
layout(binding = 7) uniform sampler2D levelNormalTexture;
layout(binding = 10) uniform sampler2D levelAlbedoTexture;
layout(binding = 11) uniform sampler2D levelEmissionTexture;
#define levelPosition (levelPlace + levelOrigin)
bool levelOpaque() {
  float alpha = levelAlbedoFactor.a * levelColor.a * texture(levelAlbedoTexture, levelUvAlbedo).a;
  return levelAlphaCutoff < 0.0 || alpha >= levelAlphaCutoff;
}
vec3 levelAlbedo() { return levelAlbedoFactor.rgb * levelColor.rgb * texture(levelAlbedoTexture, levelUvAlbedo).rgb; }
vec3 levelEmission() {
  if (!gl_FrontFacing && !levelDoubleSided) return vec3(0.0);
  return levelEmissionFactor * texture(levelEmissionTexture, levelUvEmission).rgb;
}
// Normal of the triangle's plane, of no particular length.
vec3 levelFace() {
  vec3 dx = dFdx(levelPlace), dy = dFdy(levelPlace);
  // A neighbour past the plane's horizon is extrapolated to behind the eye, which turns the cross product round. How dx
  // and dy look in the picture tells: seen from a point before the eye they lead right and up.
  vec4 clip = levelClip * vec4(levelPlace, 1.0);
  mat2x4 moved = levelClip * mat2x4(vec4(dx, 0.0), vec4(dy, 0.0));
  vec2 place = clip.xy / clip.w, right = moved[0].xy - moved[0].w * place, up = moved[1].xy - moved[1].w * place;
  return right.x * up.y < right.y * up.x ? cross(dy, dx) : cross(dx, dy);
}
vec3 levelNormal() {
  vec3 n = normalize(levelVertexNormal);
  // Mesh normals may disagree with the winding: the front's normal is on the geometric normal's side.
  n = dot(n, levelFace()) < 0.0 ? -n : n;
  if (levelGlossFactor.w > 0.0) {
    // mappedNormal() of relume/bake/scene.h, of the front; the back has the opposite.
    vec3 texel = 2.0 * texture(levelNormalTexture, levelUvGlossNormal.zw).xyz - 1.0;
    vec3 front = gl_FrontFacing ? n : -n, x = levelTangent.xyz - front * dot(front, levelTangent.xyz);
    float size = length(x);
    if (size > 0.0 && levelTangent.w != 0.0) {
      x /= size;
      vec3 y = cross(front, x) * sign(levelTangent.w);
      vec3 bent = levelGlossFactor.z * (texel.x * x + texel.y * y) + texel.z * front;
      if (dot(bent, bent) > 0.0) n = normalize(gl_FrontFacing ? bent : -bent);
    }
  }
  return n;
}
vec2 levelMetalRough() { return levelGlossFactor.xy * texture(levelGlossTexture, levelUvGlossNormal.xy).bg; }
bool levelOnLightmap(out vec2 uv) {
  uv = gl_FrontFacing ? levelLightmapUv.xy : levelLightmapUv.zw;
  return (gl_FrontFacing ? levelGridLit.x : levelGridLit.y) == 0u;
}
)";
}

}  // namespace relume
