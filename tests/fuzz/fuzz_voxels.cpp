// SPDX-License-Identifier: MIT
// libFuzzer: any bytes as a level that is voxelised, moved, edited and lit live, on the CPU. Nothing may crash; what is
// refused changes nothing; and every number that comes out is finite and not negative.
#include "runtime/cones/cone_light.h"
#include "runtime/cones/rsm_voxels.h"
#include "runtime/live/nested_caches.h"
#include "runtime/live/rsm_light.h"
#include "runtime/voxels/nested_volumes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

using namespace relume;

namespace {

// Reads numbers off the input, zeros behind its end.
class Reader {
 public:
  Reader(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  template <class T>
  T take() {
    T value{};
    const std::size_t count = std::min(sizeof value, size_ - at_);
    std::memcpy(&value, data_ + at_, count);
    at_ += count;
    return value;
  }
  // Mostly a small number, sometimes any bits at all.
  float number() {
    const auto bits = take<std::uint16_t>();
    if (bits % 61 == 60) return take<float>();
    return static_cast<float>(static_cast<std::int16_t>(bits)) / 1024.0f;
  }
  glm::vec3 vector() {
    const float x = number(), y = number();
    return {x, y, number()};
  }
  glm::mat4x3 transform() {
    const auto kind = take<std::uint8_t>();
    glm::mat4x3 m(1.0f);
    if (kind % 4 == 1) m = glm::mat4x3(vector(), vector(), vector(), glm::vec3(0.0f));
    if (kind % 4 != 0) m[3] = vector();
    return m;
  }
  bool empty() const { return at_ >= size_; }

 private:
  const std::uint8_t* data_;
  std::size_t size_, at_ = 0;
};

bool isLight(const glm::vec3& e) {
  return std::isfinite(e.x) && std::isfinite(e.y) && std::isfinite(e.z) && e.x >= 0.0f && e.y >= 0.0f && e.z >= 0.0f;
}

void check(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "does not hold: %s\n", what);
  std::abort();
}
#define CHECK(condition) check(condition, #condition)

// A frame of light, and reads of it; rays hit what is occupied.
void lightAndRead(VoxelVolume& volume, LiveCaches& live, Reader& in) {
  const std::array<Light, 2> lights = {Light{.intensity = {60, 40, 1}, .positionWorld = in.vector()},
                                       Light{.kind = LightKind::directional, .direction = {0, -1, 0}}};
  LightSetup setup;
  setup.lights = lights;
  (void)volume.lightDirectly(setup);
  LiveFrame frame;
  frame.keep = 0.5f;
  frame.sky.radiance = {0.5f, 1.0f, 0.0f};
  frame.raySet = in.take<std::uint8_t>();
  CHECK(static_cast<bool>(live.update(volume, frame)));
  for (const VoxelRadiance& radiance : volume.radiance()) CHECK(isLight(radiance.front()) && isLight(radiance.back()));
  for (const float c : live.coefficients()) CHECK(std::isfinite(c));
  for (int i = 0; i < 8; ++i) {
    const glm::vec3 place = in.vector(), normal = in.vector();
    CHECK(isLight(live.irradiance(place, normal)));
    const glm::vec3 direction(0.6f, i % 2 == 0 ? 0.8f : -0.8f, 0.0f);
    if (!std::isfinite(place.x + place.y + place.z)) continue;
    const MarchHit hit = volume.march(place, direction, 1e6f);
    if (!hit.found) continue;
    CHECK(volume.grid().holds(hit.voxel));
    for (const unsigned subVoxel : {0u, 21u, 63u}) {
      for (int across = -1; across < 3; ++across)
        CHECK(isLight(volume.radianceAt({hit.voxel, hit.t, true, subVoxel, across}, direction)));
    }
  }
}

// The same from a map of any texels.
void lightByMap(const VoxelVolume& volume, Reader& in) {
  std::array<RsmTexel, 16> texels;
  for (RsmTexel& t : texels) t = {in.vector(), in.number(), {0, 1, 0}, in.vector()};
  const RsmImage image{texels, 4, 1};
  const auto bits = in.take<std::uint8_t>();
  RsmOptions options;
  options.bands = {1 + bits % 3, 1 + bits / 3 % 3};
  options.visibility = static_cast<CellVisibility>(bits % 3);
  options.samples = 1 + bits;
  auto light = RsmLight::create(options);
  if (!light) return;
  RsmFrame frame;
  frame.images = {&image, 1};
  frame.sampleSet = bits;
  frame.keep = in.number();
  const bool isUpdated = static_cast<bool>(light->update(volume, frame));
  CHECK(!isUpdated || static_cast<bool>(checkRsm(frame.images)));
  for (const float number : light->field().numbers) CHECK(std::isfinite(number));
  CHECK(isLight(light->irradiance(in.vector(), in.vector())));

  VoxelVolume lit = volume;
  RsmVoxels maps;
  if (!maps.light(lit, frame.images, glm::abs(in.vector()))) return;
  for (const VoxelRadiance& radiance : lit.radiance()) CHECK(isLight(radiance.front()) && isLight(radiance.back()));
  CHECK(maps.arrived() >= 0.0f && maps.arrived() <= 1.0f);
}

// Cones of any numbers through it.
void followCones(const VoxelVolume& volume, Reader& in) {
  RadianceMips mips(in.take<std::uint8_t>() % 2 == 0 ? RadianceMips::Directions::six : RadianceMips::Directions::one);
  CHECK(static_cast<bool>(mips.update(volume)));
  const ConeTracer cones(volume, mips, {});
  for (int i = 0; i < 4; ++i) {
    const Cone cone{in.vector(), in.vector(), in.vector(), in.number(), in.number()};
    const ConeLight light = mips.trace(volume, cone);
    CHECK(isLight(light.radiance) && light.clear >= 0.0f && light.clear <= 1.0f);
    CHECK(isLight(cones.glossy(cone.originWorld, {0, 1, 0}, {0.6f, 0.8f, 0}, in.number())));
    const Gathered around = cones.hemisphere(cone.originWorld, {0, 1, 0}, {0.6f, 0.8f, 0}, 1.0f);
    CHECK(isLight(around.radiance) && around.occlusion >= 0.0f && around.occlusion <= 1.001f);
  }
}

// Volumes in one another, which an eye at any place moves: their bits are those of a volume over the same grid.
void followAnEye(const VoxelGeometry& level, const VoxelOptions& box, Reader& in) {
  NestedOptions options;
  options.outermost = box;
  const auto bits = in.take<std::uint8_t>();
  options.cascades = 1 + bits % 3;
  options.boxFollowsEye = (bits & 16) != 0;
  if ((bits & 32) != 0) options.eyeWorld = in.vector();
  Result<NestedVolumes> volumes = NestedVolumes::create(level, options);
  if (!volumes) return;
  Result<NestedCaches> live = NestedCaches::create({8});
  CHECK(static_cast<bool>(live));
  for (int step = 0; step < 3 && !in.empty(); ++step) {
    (void)volumes->centre(in.vector());
    LiveFrame frame;
    frame.sky.radiance = {0.5f, 1.0f, 0.0f};
    CHECK(static_cast<bool>(live->update(*volumes, frame)));
    CHECK(isLight(live->irradiance(in.vector(), in.vector())));
    const glm::vec3 from = in.vector();
    if (std::isfinite(from.x + from.y + from.z)) CHECK(isLight(volumes->radianceAlong(from, {0.6f, 0.8f, 0.0f})));
  }
  for (const VoxelVolume& volume : volumes->all()) {
    const Result<VoxelVolume> made = volume.over(volume.grid());
    CHECK(static_cast<bool>(made));
    CHECK(std::equal(volume.bits().begin(), volume.bits().end(), made->bits().begin()));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Reader in(data, size);
  // A level: surfaces, two meshes that three parts share.
  std::vector<VoxelSurface> surfaces(1 + in.take<std::uint8_t>() % 3);
  for (VoxelSurface& s : surfaces) {
    const auto bits = in.take<std::uint8_t>();
    s.albedo = glm::vec3(static_cast<float>(bits & 15) / 15.0f);
    if (bits & 16) s.emission = in.vector();
    if (bits & 32) s.coverage = in.number();
    s.doubleSided = (bits & 64) != 0;
  }
  struct Mesh {
    std::vector<glm::vec3> position;
    std::vector<glm::uvec3> triangle;
    std::vector<std::uint32_t> surface;
  };
  std::array<Mesh, 2> meshes;
  for (Mesh& mesh : meshes) {
    mesh.position.resize(in.take<std::uint8_t>() % 24);
    for (glm::vec3& p : mesh.position) p = in.vector();
    mesh.triangle.resize(in.take<std::uint8_t>() % 32);
    for (glm::uvec3& t : mesh.triangle) {
      const auto vertices = static_cast<std::uint32_t>(mesh.position.size()) + (in.take<std::uint8_t>() == 255 ? 1 : 0);
      for (int k = 0; k < 3; ++k) t[k] = in.take<std::uint8_t>() % std::max(vertices, 1u);
      mesh.surface.push_back(in.take<std::uint8_t>() % static_cast<std::uint32_t>(surfaces.size()));
    }
  }
  const std::array<VoxelMesh, 2> views{VoxelMesh{meshes[0].position, meshes[0].triangle, meshes[0].surface},
                                       VoxelMesh{meshes[1].position, meshes[1].triangle, meshes[1].surface}};
  std::array<VoxelPart, 3> parts;
  for (std::size_t i = 0; i < parts.size(); ++i) parts[i] = {static_cast<std::uint32_t>(i / 2), in.transform(), i == 1};
  VoxelOptions options;
  options.cells = 8;
  if (in.take<std::uint8_t>() % 2 == 1) {
    options.boxMin = in.vector();
    options.boxMax = options.boxMin + glm::abs(in.vector());
  }
  if (in.take<std::uint8_t>() % 8 == 7) options.surfaceBudget = in.take<std::uint8_t>();

  Result<VoxelVolume> volume = VoxelVolume::create({surfaces, views, parts}, options);
  if (!volume) return 0;
  Result<LiveCaches> live = LiveCaches::create({8});
  CHECK(static_cast<bool>(live));
  lightAndRead(*volume, *live, in);
  lightByMap(*volume, in);
  followCones(*volume, in);
  followAnEye({surfaces, views, parts}, options, in);
  for (int step = 0; step < 3 && !in.empty(); ++step) {
    const std::vector<std::uint64_t> before(volume->bits().begin(), volume->bits().end());
    const glm::mat4x3 to = in.transform();
    const auto kind = in.take<std::uint8_t>();
    const PartEdit edit{kind / 2u % 4u, to, kind < 128};
    const Status ok = kind % 2 == 0 ? volume->move({&to, 1}) : volume->edit({&edit, 1});
    if (!ok) CHECK(std::equal(before.begin(), before.end(), volume->bits().begin()));
    lightAndRead(*volume, *live, in);
  }
  return 0;
}
