// SPDX-License-Identifier: MIT
// Builds the acceleration structure. Every instance that rays meet becomes a triangle geometry in world space, which
// traces fastest. In large levels whose instances have several times as many triangles as their meshes, and in the
// largest ones whatever their meshes have, instances of a mesh share one structure instead. Embree's geometry (or
// instance) id is the index into State::instance. Vertices come from Scene::corners(), so that barycentrics are in its
// winding by construction. Levels far from the origin are traced relative to their centre, where floats are dense.
#include "bake/rays/ray_tracer_name.h"
#include "bake/rays/ray_tracer_state.h"

#include "bake/base/parallel.h"
#include "bake/rays/built_triangles.h"
#include "bake/rays/far_level.h"
#include "bake/rays/ray_piles.h"
#include "formats/decimal.h"

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <future>
#include <limits>
#include <map>
#include <string>
#include <utility>

namespace relume {
namespace {

constexpr std::uint64_t kMaxBundleTriangles = 1u << 22;  // 64 bytes each; levels with more trace packets
// [triangles] Above the first, meshes with several instances are shared where that leaves a quarter of them at most;
// above the second always. A shared structure takes no memory for each instance, and is traced more slowly; triangles
// of it that overlap are not told apart.
constexpr std::uint64_t kShareLimit = kMaxBundleTriangles, kFlattenLimit = 1u << 24, kWorthSharing = 4;
static_assert(kMaxBundleTriangles <= kShareLimit);  // the vertices of bundles are in the world's space
constexpr float kFarCentre = 16.0f;                 // a level this many of its own sizes from the origin is recentred
constexpr float kRoundingToTell = 1e-3f;            // [of its size] how far rays may start from its surfaces

// World bounds of the triangles that rays meet, and how many such instances each mesh has.
struct Survey {
  glm::vec3 min{std::numeric_limits<float>::infinity()}, max{-std::numeric_limits<float>::infinity()};
  std::vector<std::uint32_t> uses;  // [Size meshes]

  glm::vec3 centre() const { return 0.5f * min + 0.5f * max; }
  float size() const { return largest(max - min); }  // [m]
  bool isFar() const { return largest(centre()) > kFarCentre * size(); }
};

void warnOfRounding(const Survey& level, Context& context) {
  const float far = std::max(largest(level.min), largest(level.max)), size = level.size();
  const float apart = std::numeric_limits<float>::epsilon() * far, off = kFarEpsilonUlps * apart;
  if (!(off > kRoundingToTell * size)) return;
  context.message(Severity::warning,
                  "the level, " + decimalGeneral(size, 3) + " m large, lies " + decimalGeneral(far, 3) +
                      " m from the origin, where places are " + decimalGeneral(apart, 2) + " m apart: rays start " +
                      decimalGeneral(off, 2) +
                      " m off its surfaces, and edges and corners have wrong light; move it nearer to the origin");
}

// Why there is no device.
Error startError(RTCError reason, const std::string& isa) {
  if (reason == RTC_ERROR_OUT_OF_MEMORY)
    return {ErrorCode::memory, "ray tracer: memory ran out while Embree was starting"};
  if (reason == RTC_ERROR_UNSUPPORTED_CPU)
    return {ErrorCode::unsupported, "ray tracer: this processor has no " + isa +
                                        "; for a bake, choose another instruction set by embreeIsa (--isa)"};
  return {ErrorCode::failed,
          "Embree cannot start with \"isa=" + isa + "\": error " + std::to_string(static_cast<int>(reason))};
}

// Let rays through the texels that the alpha test cuts out.
void alphaFilter(const RTCFilterFunctionNArguments* args) {
  const auto& mesh = *static_cast<const MaskedMesh*>(args->geometryUserPtr);
  for (unsigned i = 0; i < args->N; ++i) {
    if (args->valid[i] != -1) continue;
    const unsigned n = args->N, triangle = RTCHitN_primID(args->hit, n, i);
    HitPoints<1> point;
    point.put(0, cornersAt(mesh.vertices, triangle),
              {RTCRayN_org_x(args->ray, n, i), RTCRayN_org_y(args->ray, n, i), RTCRayN_org_z(args->ray, n, i)},
              {RTCRayN_dir_x(args->ray, n, i), RTCRayN_dir_y(args->ray, n, i), RTCRayN_dir_z(args->ray, n, i)}, 0.0f,
              std::numeric_limits<float>::infinity());
    findHitPoints(point);
    if (!opaqueAt(*mesh.scene, {mesh.instance, triangle, point.barycentric(0)})) args->valid[i] = 0;
  }
}

bool isMasked(const Scene& scene, const Instance& instance) {
  return scene.meshes[instance.mesh].material != kNone && scene.material(instance).alphaMode == AlphaMode::mask;
}

bool isInvertible(const glm::mat4& m) {
  const float det = glm::determinant(glm::mat3(m));
  return std::isfinite(det) && std::abs(det) > std::numeric_limits<float>::min();
}

// The triangles of one instance, moved by -shift, as a committed Embree geometry. null on failure (device error set).
// buried: which triangles stay out of it; empty: none.
RTCGeometry makeGeometry(RTCDevice device, RTCBuildQuality quality, const Scene& scene, const Instance& instance,
                         const glm::vec3& shift, std::span<const std::uint8_t> buried, MaskedMesh* masked,
                         const float*& shared) {
  const std::size_t count = scene.meshes[instance.mesh].triangle.size();
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), 3 * count));
  auto* indices = static_cast<std::uint32_t*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), count));
  if (vertices == nullptr || indices == nullptr) {
    rtcReleaseGeometry(geometry);
    return nullptr;
  }
  for (std::size_t t = 0; t < count; ++t) {
    const auto corners = scene.corners(instance, static_cast<std::uint32_t>(t));
    for (std::size_t c = 0; c < 3; ++c) {
      const glm::vec3 p = corners[c] - shift;
      std::memcpy(vertices + 3 * (3 * t + c), &p, sizeof p);
      // Embree leaves out triangles of vertices that do not exist.
      const bool isIn = buried.empty() || buried[t] == 0;
      indices[3 * t + c] = isIn ? static_cast<std::uint32_t>(3 * t + c) : kNone;
    }
  }
  shared = vertices;
  if (masked != nullptr) {
    masked->vertices = vertices;
    rtcSetGeometryUserData(geometry, masked);
    rtcSetGeometryIntersectFilterFunction(geometry, alphaFilter);
    rtcSetGeometryOccludedFilterFunction(geometry, alphaFilter);
  }
  rtcSetGeometryBuildQuality(geometry, quality);
  rtcCommitGeometry(geometry);
  return geometry;
}

// Embree calls this while it builds, to ask whether to go on.
bool goesOn(void* context, double) { return !static_cast<const Context*>(context)->cancelled(); }

// Without RTC_SCENE_FLAG_ROBUST: it would take 1.75 times as long. The price is that one random ray in ten million
// slips through an edge, which makes no difference to a cache.
ScenePtr makeScene(RTCDevice device, RTCBuildQuality quality, Context& context) {
  ScenePtr scene(rtcNewScene(device));
  rtcSetSceneBuildQuality(scene.get(), quality);
  rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
  rtcSetSceneProgressMonitorFunction(scene.get(), goesOn, &context);
  return scene;
}

// Build on one thread, so that the tree is always the same. With several, the order of primitives in it would depend on
// their number, and with that, which of two coincident surfaces is hit.
void commit(RTCScene scene) {
  runOnOneThread([scene] { rtcCommitScene(scene); });
}

bool isMet(const Scene& scene, const Instance& instance, RayGeometry geometry) {
  const bool asked = instance.baked() || (geometry == RayGeometry::drawn && instance.mode == BakeMode::dynamic);
  return asked && !scene.meshes[instance.mesh].triangle.empty();
}

Survey survey(const Scene& scene, RayGeometry geometry) {
  Survey s;
  s.uses.resize(scene.meshes.size());
  for (const Instance& instance : scene.instances) {
    const Mesh& mesh = scene.meshes[instance.mesh];
    if (!isMet(scene, instance, geometry)) continue;
    ++s.uses[instance.mesh];
    for (const glm::uvec3& triangle : mesh.triangle) {
      for (int c = 0; c < 3; ++c) {
        const glm::vec3 p = instance.toWorld * glm::vec4(mesh.position[triangle[c]], 1.0f);
        if (!std::isfinite(p.x + p.y + p.z)) continue;
        s.min = glm::min(s.min, p);
        s.max = glm::max(s.max, p);
      }
    }
  }
  if (!(s.min.x <= s.max.x)) s.min = s.max = glm::vec3(0.0f);
  return s;
}

std::vector<std::uint32_t> metInstances(const Scene& scene, RayGeometry geometry) {
  std::vector<std::uint32_t> met;
  for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
    if (isMet(scene, scene.instances[i], geometry)) met.push_back(i);
  }
  return met;
}

// Whether all of an instance's triangles are buried.
bool isWholly(const std::vector<std::uint8_t>& buried) {
  return !buried.empty() && std::all_of(buried.begin(), buried.end(), [](std::uint8_t b) { return b != 0; });
}

}  // namespace

void warnOfFarLevel(const Scene& scene, Context& context) {
  const Survey level = survey(scene, RayGeometry::drawn);
  if (level.isFar()) warnOfRounding(level, context);
}

bool BuiltTriangles::isShared() const {
  return triangles > kFlattenLimit || (triangles > kShareLimit && triangles >= kWorthSharing * ofMeshes);
}

BuiltTriangles builtTriangles(const Scene& scene, RayGeometry geometry) {
  BuiltTriangles count;
  std::vector<std::uint32_t> uses(scene.meshes.size(), 0);
  const std::vector<std::uint32_t> met = metInstances(scene, geometry);
  for (const std::uint32_t i : met) ++uses[scene.instances[i].mesh];
  std::vector<std::uint8_t> known(scene.meshes.size(), 0);  // bits: of either winding
  for (const std::uint32_t i : met) {
    const Instance& instance = scene.instances[i];
    const std::size_t triangles = scene.meshes[instance.mesh].triangle.size();
    const std::uint8_t winding = instance.flipped ? 2 : 1;
    const bool mayShare = uses[instance.mesh] > 1 && isInvertible(instance.toWorld);
    ++count.instances;
    count.triangles += triangles;
    if (known[instance.mesh] == 0) count.ofMeshes += triangles;
    if (!mayShare || (known[instance.mesh] & winding) == 0) count.inShared += triangles;
    known[instance.mesh] |= winding;
  }
  return count;
}

BundleTree RayTracer::State::makeBundleTree(const Context& context) const {
  std::vector<BundleTriangle> triangles;
  for (std::uint32_t id = 0; id < instance.size() && !context.cancelled(); ++id) {
    const Instance& met = scene->instances[instance[id]];
    const std::uint32_t alphaTest = isMasked(*scene, met) ? kBundleMasked : 0;
    for (std::uint32_t t = 0; t < scene->meshes[met.mesh].triangle.size(); ++t) {
      if (isBuried(id, t)) continue;
      triangles.push_back({cornersAt(vertices[id], t), id | alphaTest, t});
    }
  }
  return buildBundleTree(device.get(), triangles, context);
}

void RayTracer::State::noteOverlapsInBundleTree() {
  for (BundleLeaf& leaf : bundles.leaves) {
    for (std::uint32_t i = 0; i < kBundleLanes; ++i) {
      if (overlaps[leaf.geometry[i] & kBundleGeometry][leaf.triangle[i]] != 0) leaf.geometry[i] |= kBundleOverlaps;
    }
  }
}

Result<RayTracer> RayTracer::create(const Scene& scene, const std::string& isa, Context& context,
                                    RayStructure structure, RayGeometry geometry) {
  auto state = std::make_unique<State>();
  state->scene = &scene;
  state->geometry = geometry;

  // Open the device. Its option "threads" is not used: it would limit all of oneTBB for as long as the device lives.
  state->device.reset(rtcNewDevice(deviceConfig(isa).c_str()));
  if (!state->device) return startError(rtcGetDeviceError(nullptr), isa);
  RTCDevice device = state->device.get();
  rtcSetDeviceErrorFunction(device, State::onError, state.get());
  if (rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0) {
    state->width = 16;
  } else if (rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) != 0) {
    state->width = 8;
  }
  state->description = rayTracerName(device, isa);

  // Measure the level; trace it around its own centre when it is far from the origin.
  const Survey level = survey(scene, geometry);
  state->boundsMin = level.min;
  state->boundsMax = level.max;
  if (level.isFar()) {
    state->shift = level.centre();
    warnOfRounding(level, context);
  }
  state->epsilonFloor = kEpsilonUlps * std::numeric_limits<float>::epsilon() * 0.5f * level.size();

  const glm::vec3 reach = glm::max(glm::abs(level.min - state->shift), glm::abs(level.max - state->shift));
  state->rounding = std::max(kEpsilonUlps * std::numeric_limits<float>::epsilon() * largest(reach),
                             std::numeric_limits<float>::min());

  // Add the instances, in their order.
  const BuiltTriangles count = builtTriangles(scene, geometry);
  const bool share = count.isShared();
  const bool hasBundles = isForBundles(structure) && count.triangles <= kMaxBundleTriangles;
  const RTCBuildQuality quality = isQuick(structure) ? RTC_BUILD_QUALITY_MEDIUM : RTC_BUILD_QUALITY_HIGH;
  std::map<std::pair<std::uint32_t, bool>, RTCScene> sharedOf;  // by mesh and winding
  state->top = makeScene(device, quality, context);
  const std::vector<std::uint32_t> met = metInstances(scene, geometry);
  state->buried.resize(met.size());
  std::vector<std::uint8_t> isBuried(met.size(), 0);
  if (share) {
    isBuried = findBuriedInstances(scene, met);
  } else {
    state->buried = findBuried(scene, met, context);
    for (std::size_t id = 0; id < met.size(); ++id) isBuried[id] = isWholly(state->buried[id]);
  }
  for (const std::uint32_t i : met) {
    const Instance& instance = scene.instances[i];
    if (context.cancelled()) return cancelledError();
    const auto id = static_cast<unsigned>(state->instance.size());
    state->instance.push_back(i);
    state->vertices.push_back(nullptr);
    if (isBuried[id] != 0) continue;
    const auto makeMasked = [&]() -> MaskedMesh* {
      if (!isMasked(scene, instance)) return nullptr;
      state->masked.push_back(std::make_unique<MaskedMesh>(MaskedMesh{&scene, i}));
      return state->masked.back().get();
    };

    RTCGeometry built = nullptr;
    if (share && level.uses[instance.mesh] > 1 && isInvertible(instance.toWorld)) {
      RTCScene& below = sharedOf[{instance.mesh, instance.flipped}];
      if (below == nullptr) {
        Instance inPlace = instance;
        inPlace.toWorld = glm::mat4(1.0f);
        const float* inObject = nullptr;
        RTCGeometry mesh = makeGeometry(device, quality, scene, inPlace, glm::vec3(0.0f), {}, makeMasked(), inObject);
        if (mesh == nullptr) break;
        state->shared.push_back(makeScene(device, quality, context));
        below = state->shared.back().get();
        rtcAttachGeometry(below, mesh);
        rtcReleaseGeometry(mesh);
        commit(below);
      }
      glm::mat4 toTraced = instance.toWorld;
      toTraced[3] -= glm::vec4(state->shift, 0.0f);
      built = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
      rtcSetGeometryInstancedScene(built, below);
      rtcSetGeometryTransform(built, 0, RTC_FORMAT_FLOAT4X4_COLUMN_MAJOR, &toTraced[0][0]);
      rtcCommitGeometry(built);
    } else {
      built = makeGeometry(device, quality, scene, instance, state->shift, state->buried[id], makeMasked(),
                           state->vertices[id]);
      if (built == nullptr) break;
    }
    rtcAttachGeometryByID(state->top.get(), built, id);
    rtcReleaseGeometry(built);
  }
  // Build both structures, each on a thread of its own where there may be two.
  if (state->error.empty()) {
    runOnOneThread([&] {
      const auto launch = context.threads == 1 ? std::launch::deferred : std::launch::async;
      std::future<BundleTree> bundles;
      if (hasBundles) bundles = std::async(launch, [&] { return state->makeBundleTree(context); });
      rtcCommitScene(state->top.get());
      if (hasBundles) state->bundles = bundles.get();
    });
  }
  if (context.cancelled()) return cancelledError();
  if (!state->error.empty()) return Error{ErrorCode::failed, "Embree: " + state->error};
  // Stop asking the context: it may be destroyed before the tracer.
  rtcSetSceneProgressMonitorFunction(state->top.get(), nullptr, nullptr);
  for (const ScenePtr& below : state->shared) rtcSetSceneProgressMonitorFunction(below.get(), nullptr, nullptr);
  state->overlaps.resize(state->vertices.size());
  if (structure != RayStructure::shadows) state->findOverlaps(context);
  if (context.cancelled()) return cancelledError();
  state->noteOverlapsInBundleTree();
  return RayTracer(std::move(state));
}

}  // namespace relume
