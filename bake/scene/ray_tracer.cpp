// SPDX-License-Identifier: MIT
// Rays by Embree 3. Every fixed instance becomes a triangle geometry in world space, which traces fastest; levels whose
// instances add up to more triangles than kFlattenLimit share one structure per mesh instead. Embree's geometry (or
// instance) id is the index into Geometry::instance. Vertices come from Scene::corners(), so that barycentrics are in
// its winding by construction. Levels far from the origin are traced relative to their centre, where floats are dense.
// Embree divides by approximate reciprocals (rcpps), whose last bits are the processor maker's own: it says which triangle
// a ray hits, where on it is computed here. Where several are in one place (on edges, and where surfaces overlap, which is
// found beforehand), a second query names them all and one is taken by rule.
#include "bake/scene/ray_tracer.h"

#include "bake/context.h"
#include "bake/parallel.h"
#include "bake/scene/hit_places.h"

#include <embree3/rtcore.h>
#if defined(__SSE2__)
#include <pmmintrin.h>
#include <xmmintrin.h>
#endif

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <map>
#include <tuple>
#include <utility>

namespace relume {
namespace {

constexpr std::uint64_t kFlattenLimit = 1u << 24;  // [triangles] above it, meshes with several instances are shared
constexpr float kFarCentre = 16.0f;                // a level this many of its own sizes from the origin is recentred
constexpr float kEpsilonUlps = 16.0f;              // a hit's position is off by a few roundings of its coordinates
constexpr float kMostPerDepth = 100.0f;            // rays that graze more are taken to tie no farther

// Flush denormals in this thread while rays are traced, and only then: exact predicates elsewhere need them.
class FlushDenormals {
 public:
#if defined(__SSE2__)
  FlushDenormals() : saved_(_mm_getcsr()) { _mm_setcsr(saved_ | _MM_FLUSH_ZERO_ON | _MM_DENORMALS_ZERO_ON); }
  ~FlushDenormals() { _mm_setcsr(saved_); }

 private:
  unsigned saved_;
#else
  FlushDenormals() {}
  ~FlushDenormals() {}
#endif
 public:
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;
};

struct DeviceDeleter {
  void operator()(RTCDeviceTy* device) const { rtcReleaseDevice(device); }
};
struct SceneDeleter {
  void operator()(RTCSceneTy* scene) const { rtcReleaseScene(scene); }
};
using DevicePtr = std::unique_ptr<RTCDeviceTy, DeviceDeleter>;
using ScenePtr = std::unique_ptr<RTCSceneTy, SceneDeleter>;

float largest(const glm::vec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

Corners cornersAt(const float* vertices, std::uint32_t triangle) {
  Corners c;
  std::memcpy(&c, vertices + 9 * static_cast<std::size_t>(triangle), sizeof c);
  return c;
}

// What the alpha test of a geometry needs to name a surface point.
struct MaskedMesh {
  const Scene* scene = nullptr;
  std::uint32_t instance = kNone;  // any instance of the mesh: its texture coordinates do not depend on the place
  const float* vertices = nullptr; // [Size 9 x triangles] Embree's, in the space its rays are handed over
};

// Let rays through the texels that the alpha test cuts out.
void alphaFilter(const RTCFilterFunctionNArguments* args) {
  const auto& mesh = *static_cast<const MaskedMesh*>(args->geometryUserPtr);
  for (unsigned i = 0; i < args->N; ++i) {
    if (args->valid[i] != -1) continue;
    const unsigned n = args->N, triangle = RTCHitN_primID(args->hit, n, i);
    HitPlaces<1> place;
    place.put(0, cornersAt(mesh.vertices, triangle),
              {RTCRayN_org_x(args->ray, n, i), RTCRayN_org_y(args->ray, n, i), RTCRayN_org_z(args->ray, n, i)},
              {RTCRayN_dir_x(args->ray, n, i), RTCRayN_dir_y(args->ray, n, i), RTCRayN_dir_z(args->ray, n, i)}, 0.0f,
              std::numeric_limits<float>::infinity());
    findHitPlaces(place);
    if (!opaqueAt(*mesh.scene, {mesh.instance, triangle, place.barycentric(0)})) args->valid[i] = 0;
  }
}

bool isMasked(const Scene& scene, const Instance& instance) {
  return scene.meshes[instance.mesh].material != kNone && scene.material(instance).alphaMode == AlphaMode::mask;
}

bool isInvertible(const glm::mat4& m) {
  const float det = glm::determinant(glm::mat3(m));
  return std::isfinite(det) && std::abs(det) > std::numeric_limits<float>::min();
}

}  // namespace

struct RayTracer::State {
  const Scene* scene = nullptr;
  DevicePtr device;  // released after the scenes
  std::vector<ScenePtr> shared;
  ScenePtr top;
  std::vector<std::unique_ptr<MaskedMesh>> masked;
  std::vector<std::uint32_t> instance;   // [Size geometries] instance of a geometry id of the top scene
  std::vector<const float*> vertices;    // [Size geometries] Embree's, as traced, 9 a triangle; null where shared
  glm::vec3 shift{0.0f};                 // [m] traced coordinates are world minus shift
  glm::vec3 boundsMin{0.0f}, boundsMax{0.0f};  // [m]
  float epsilonFloor = 0.0f;             // [m]
  float rounding = 0.0f;                 // [m] of traced coordinates
  std::vector<std::vector<std::uint8_t>> overlaps;  // [Size geometries][Size triangles, 0 where shared] 1: others there
  unsigned width = 1;                    // rays a packet
  std::string error, description;

  static void onError(void* self, RTCError, const char* text) {
    auto& state = *static_cast<State*>(self);
    if (state.error.empty()) state.error = text;
  }

  Corners cornersOf(unsigned id, std::uint32_t triangle) const;
  // Hits of rays on triangles of geometries (or instances) of the top scene. geomId: invalid = nothing hit.
  template <unsigned Width>
  void toHits(std::span<const Ray> rays, const unsigned* geomId, const unsigned* instanceId, const unsigned* triangle,
              std::span<Hit> hits) const;
  Hit settle(const Ray& ray, unsigned id, std::uint32_t triangle, float distance) const;
  void findOverlaps(Context& context);
};

namespace {

// The triangles of one instance, moved by -shift, as a committed Embree geometry. null on failure (device error set).
RTCGeometry makeGeometry(RTCDevice device, RTCBuildQuality quality, const Scene& scene, const Instance& instance,
                         const glm::vec3& shift, MaskedMesh* masked, const float*& placed) {
  const std::size_t count = scene.meshes[instance.mesh].triangle.size();
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                               3 * sizeof(float), 3 * count));
  auto* indices = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0,
                                                                      RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t),
                                                                      count));
  if (vertices == nullptr || indices == nullptr) {
    rtcReleaseGeometry(geometry);
    return nullptr;
  }
  for (std::size_t t = 0; t < count; ++t) {
    const auto corners = scene.corners(instance, static_cast<std::uint32_t>(t));
    for (std::size_t c = 0; c < 3; ++c) {
      const glm::vec3 p = corners[c] - shift;
      std::memcpy(vertices + 3 * (3 * t + c), &p, sizeof p);
      indices[3 * t + c] = static_cast<std::uint32_t>(3 * t + c);
    }
  }
  placed = vertices;
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

// Not RTC_SCENE_FLAG_ROBUST: it costs 1.75 times the time, and without it one random ray of ten million slips through
// an edge, which no cache notices.
ScenePtr makeScene(RTCDevice device, RTCBuildQuality quality) {
  ScenePtr scene(rtcNewScene(device));
  rtcSetSceneBuildQuality(scene.get(), quality);
  rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
  return scene;
}

// Build. The order of primitives in the tree, and with it who wins a tie between two surfaces in one place, depends on
// the number of threads: one thread, always the same tree.
void commit(RTCScene scene) {
  runOnOneThread([scene] { rtcCommitScene(scene); });
}

// World bounds of the fixed triangles, their number, and how many fixed instances each mesh has.
struct Survey {
  glm::vec3 min{std::numeric_limits<float>::infinity()}, max{-std::numeric_limits<float>::infinity()};
  std::uint64_t triangles = 0;
  std::vector<std::uint32_t> uses;  // [Size meshes]
};

Survey survey(const Scene& scene) {
  Survey s;
  s.uses.resize(scene.meshes.size());
  for (const Instance& instance : scene.instances) {
    const Mesh& mesh = scene.meshes[instance.mesh];
    if (instance.mode != BakeMode::fixed || mesh.triangle.empty()) continue;
    s.triangles += mesh.triangle.size();
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

template <class Packet>
void putRay(Packet& packet, unsigned i, const Ray& ray, const glm::vec3& shift) {
  packet.org_x[i] = ray.origin.x - shift.x;
  packet.org_y[i] = ray.origin.y - shift.y;
  packet.org_z[i] = ray.origin.z - shift.z;
  packet.dir_x[i] = ray.direction.x;
  packet.dir_y[i] = ray.direction.y;
  packet.dir_z[i] = ray.direction.z;
  packet.tnear[i] = ray.tMin;
  packet.tfar[i] = ray.tMax;
  packet.time[i] = 0.0f;
  packet.mask[i] = 0xFFFFFFFFu;
  packet.id[i] = i;
  packet.flags[i] = 0;
}

RTCRay toEmbree(const Ray& ray, const glm::vec3& shift) {
  RTCRay r{};
  r.org_x = ray.origin.x - shift.x;
  r.org_y = ray.origin.y - shift.y;
  r.org_z = ray.origin.z - shift.z;
  r.dir_x = ray.direction.x;
  r.dir_y = ray.direction.y;
  r.dir_z = ray.direction.z;
  r.tnear = ray.tMin;
  r.tfar = ray.tMax;
  r.mask = 0xFFFFFFFFu;
  return r;
}

}  // namespace

// A query whose filter notes every triangle that the ray meets, and stops at none.
template <class Note>
struct EveryHit : RTCIntersectContext {
  explicit EveryHit(const Note& note) : note_(note) {
    rtcInitIntersectContext(this);
    filter = &onHits;
  }
  void trace(RTCScene scene, const RTCRay& ray) {
    RTCRayHit rayHit{};
    rayHit.ray = ray;
    rayHit.hit.geomID = rayHit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene, this, &rayHit);
  }

 private:
  static void onHits(const RTCFilterFunctionNArguments* args) {
    for (unsigned i = 0; i < args->N; ++i) {
      if (args->valid[i] != -1) continue;
      const unsigned above = RTCHitN_instID(args->hit, args->N, i, 0);
      static_cast<const EveryHit*>(args->context)->note_(
          above != RTC_INVALID_GEOMETRY_ID ? above : RTCHitN_geomID(args->hit, args->N, i), RTCHitN_primID(args->hit, args->N, i));
      args->valid[i] = 0;
    }
  }
  const Note& note_;
};

Corners RayTracer::State::cornersOf(unsigned id, std::uint32_t triangle) const {
  if (vertices[id] != nullptr) return cornersAt(vertices[id], triangle);
  Corners c = scene->corners(scene->instances[instance[id]], triangle);
  for (glm::vec3& corner : c) corner -= shift;
  return c;
}

// [Size rays <= Width] [Size ids = Width]
template <unsigned Width>
void RayTracer::State::toHits(std::span<const Ray> rays, const unsigned* geomId, const unsigned* instanceId,
                              const unsigned* triangle, std::span<Hit> hits) const {
  unsigned ids[Width];
  for (unsigned i = 0; i < rays.size(); ++i) {
    ids[i] = instanceId[i] != RTC_INVALID_GEOMETRY_ID ? instanceId[i] : geomId[i];
#if defined(__SSE2__)
    if (geomId[i] == RTC_INVALID_GEOMETRY_ID || vertices[ids[i]] == nullptr) continue;
    const auto* first = reinterpret_cast<const char*>(vertices[ids[i]] + 9 * static_cast<std::size_t>(triangle[i]));
    _mm_prefetch(first, _MM_HINT_T0);
    _mm_prefetch(first + sizeof(Corners) - 1, _MM_HINT_T0);
#endif
  }
  HitPlaces<Width> places;
  for (unsigned i = 0; i < Width; ++i) {
    const unsigned k = std::min<unsigned>(i, static_cast<unsigned>(rays.size()) - 1);
    const Corners c = geomId[k] != RTC_INVALID_GEOMETRY_ID ? cornersOf(ids[k], triangle[k]) : Corners{};
    places.put(i, c, rays[k].origin - shift, rays[k].direction, rays[k].tMin, rays[k].tMax);
  }
  findHitPlaces(places);
  for (unsigned i = 0; i < rays.size(); ++i) {
    if (geomId[i] == RTC_INVALID_GEOMETRY_ID) {
      hits[i] = {};
    } else if (places.edge[i] < 0.0f || (!overlaps[ids[i]].empty() && overlaps[ids[i]][triangle[i]] != 0)) {
      hits[i] = settle(rays[i], ids[i], triangle[i], places.distance[i]);
    } else {
      hits[i] = {places.distance[i], instance[ids[i]], triangle[i], places.barycentric(i), places.facing[i] > 0.0f};
    }
  }
}

// Of all triangles around a hit, one whose front is hit, and among them the first: a sheet modelled twice, once for each
// side, shows each side its own.
Hit RayTracer::State::settle(const Ray& ray, unsigned id, std::uint32_t triangle, float distance) const {
  const auto rank = [&](unsigned anyId, std::uint32_t any) {
    const Corners c = cornersOf(anyId, any);
    return std::tuple(glm::dot(glm::cross(c[1] - c[0], c[2] - c[0]), ray.direction) > 0.0f, anyId, any);
  };
  auto first = rank(id, triangle);
  const auto note = [&](unsigned otherId, std::uint32_t other) { first = std::min(first, rank(otherId, other)); };
  const Corners c = cornersOf(id, triangle);
  const glm::vec3 normal = glm::cross(c[1] - c[0], c[2] - c[0]);
  const float perDepth = glm::length(normal) / std::max(std::abs(glm::dot(normal, ray.direction)), std::numeric_limits<float>::min());
  const float around = (rounding + kEpsilonUlps * std::numeric_limits<float>::epsilon() * distance) *
                       std::clamp(perDepth, 1.0f, kMostPerDepth);
  RTCRay near = toEmbree(ray, shift);
  near.tnear = std::max(near.tnear, distance - around);
  near.tfar = std::min(near.tfar, distance + around);
  EveryHit query(note);
  query.trace(top.get(), near);
  std::tie(std::ignore, id, triangle) = first;
  HitPlaces<1> place;
  place.put(0, cornersOf(id, triangle), ray.origin - shift, ray.direction, ray.tMin, ray.tMax);
  findHitPlaces(place);
  return {place.distance[0], instance[id], triangle, place.barycentric(0), place.facing[0] > 0.0f};
}

// Mark the triangles that lie in another one: near the corners or the middle of the last edge of one of the two.
void RayTracer::State::findOverlaps(Context& context) {
  constexpr glm::vec2 kPoints[] = {{0.04f, 0.04f}, {0.92f, 0.04f}, {0.04f, 0.92f}, {0.48f, 0.48f}};
  constexpr std::size_t kGrain = 2048;  // [triangles]
  for (unsigned id = 0; id < vertices.size(); ++id) {
    if (vertices[id] != nullptr) overlaps[id].resize(scene->meshes[scene->instances[instance[id]].mesh].triangle.size());
  }
  for (unsigned id = 0; id < vertices.size(); ++id) {
    parallelChunks(context, "", overlaps[id].size(), kGrain, [&](std::size_t begin, std::size_t end) {
      const FlushDenormals flush;
      for (std::size_t t = begin; t < end; ++t) {
        const auto note = [&](unsigned otherId, std::uint32_t other) {
          if (otherId == id && other == t) return;
          std::atomic_ref(overlaps[id][t]).store(1, std::memory_order_relaxed);
          if (!overlaps[otherId].empty()) std::atomic_ref(overlaps[otherId][other]).store(1, std::memory_order_relaxed);
        };
        EveryHit query(note);
        const Corners c = cornersAt(vertices[id], static_cast<std::uint32_t>(t));
        const glm::vec3 normal = glm::cross(c[1] - c[0], c[2] - c[0]);
        const float length = glm::length(normal);
        if (!(length > 0.0f)) continue;
        for (const glm::vec2 at : kPoints) {
          Ray ray;
          ray.direction = normal / length;
          ray.origin = c[0] + (c[1] - c[0]) * at.x + (c[2] - c[0]) * at.y - rounding * ray.direction;
          ray.tMax = 2.0f * rounding;
          query.trace(top.get(), toEmbree(ray, glm::vec3(0.0f)));
        }
      }
    });
  }
}

RayTracer::RayTracer(std::unique_ptr<State> state) : state_(std::move(state)) {}
RayTracer::RayTracer(RayTracer&&) noexcept = default;
RayTracer& RayTracer::operator=(RayTracer&&) noexcept = default;
RayTracer::~RayTracer() = default;

Result<RayTracer> RayTracer::create(const Scene& scene, const std::string& isa, Context& context,
                                    RayStructure structure) {
  const RTCBuildQuality quality =
      structure == RayStructure::quick ? RTC_BUILD_QUALITY_MEDIUM : RTC_BUILD_QUALITY_HIGH;
  auto state = std::make_unique<State>();
  state->scene = &scene;

  // Open the device. (Its own option "threads" would hold all of oneTBB to that number as long as the device lives.)
  const std::string config = isa.empty() ? "" : "isa=" + isa;
  state->device.reset(rtcNewDevice(config.c_str()));
  if (!state->device) {
    return Error{ErrorCode::failed, "Embree cannot start with \"" + config + "\": error " +
                                        std::to_string(static_cast<int>(rtcGetDeviceError(nullptr)))};
  }
  RTCDevice device = state->device.get();
  rtcSetDeviceErrorFunction(device, State::onError, state.get());
  if (rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0) {
    state->width = 16;
  } else if (rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) != 0) {
    state->width = 8;
  }
  const auto version = rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_VERSION);
  state->description = "embree " + std::to_string(version / 10000) + "." + std::to_string(version / 100 % 100) + "." +
                       std::to_string(version % 100) + " isa=" + (isa.empty() ? "best" : isa);

  // Measure the level; trace it around its own centre when it is far from the origin.
  const Survey level = survey(scene);
  state->boundsMin = level.min;
  state->boundsMax = level.max;
  const glm::vec3 centre = 0.5f * level.min + 0.5f * level.max, size = level.max - level.min;
  if (largest(centre) > kFarCentre * largest(size)) state->shift = centre;
  state->epsilonFloor = kEpsilonUlps * std::numeric_limits<float>::epsilon() * 0.5f * largest(size);

  const glm::vec3 reach = glm::max(glm::abs(level.min - state->shift), glm::abs(level.max - state->shift));
  state->rounding = std::max(kEpsilonUlps * std::numeric_limits<float>::epsilon() * largest(reach), std::numeric_limits<float>::min());

  // Add the instances, in their order.
  const bool share = level.triangles > kFlattenLimit;
  std::map<std::pair<std::uint32_t, bool>, RTCScene> sharedOf;  // by mesh and winding
  state->top = makeScene(device, quality);
  for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
    const Instance& instance = scene.instances[i];
    if (instance.mode != BakeMode::fixed || scene.meshes[instance.mesh].triangle.empty()) continue;
    if (context.cancelled()) return cancelledError();
    const auto id = static_cast<unsigned>(state->instance.size());
    state->instance.push_back(i);
    state->vertices.push_back(nullptr);
    const auto makeMasked = [&]() -> MaskedMesh* {
      if (!isMasked(scene, instance)) return nullptr;
      state->masked.push_back(std::make_unique<MaskedMesh>(MaskedMesh{&scene, i}));
      return state->masked.back().get();
    };

    RTCGeometry geometry = nullptr;
    if (share && level.uses[instance.mesh] > 1 && isInvertible(instance.toWorld)) {
      RTCScene& below = sharedOf[{instance.mesh, instance.flipped}];
      if (below == nullptr) {
        Instance inPlace = instance;
        inPlace.toWorld = glm::mat4(1.0f);
        const float* inObject = nullptr;
        RTCGeometry mesh = makeGeometry(device, quality, scene, inPlace, glm::vec3(0.0f), makeMasked(), inObject);
        if (mesh == nullptr) break;
        state->shared.push_back(makeScene(device, quality));
        below = state->shared.back().get();
        rtcAttachGeometry(below, mesh);
        rtcReleaseGeometry(mesh);
        commit(below);
      }
      glm::mat4 toTraced = instance.toWorld;
      toTraced[3] -= glm::vec4(state->shift, 0.0f);
      geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
      rtcSetGeometryInstancedScene(geometry, below);
      rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT4X4_COLUMN_MAJOR, &toTraced[0][0]);
      rtcCommitGeometry(geometry);
    } else {
      geometry = makeGeometry(device, quality, scene, instance, state->shift, makeMasked(), state->vertices[id]);
      if (geometry == nullptr) break;
    }
    rtcAttachGeometryByID(state->top.get(), geometry, id);
    rtcReleaseGeometry(geometry);
  }
  if (state->error.empty()) commit(state->top.get());
  if (!state->error.empty()) return Error{ErrorCode::failed, "Embree: " + state->error};
  state->overlaps.resize(state->vertices.size());
  state->findOverlaps(context);
  if (context.cancelled()) return cancelledError();
  return RayTracer(std::move(state));
}

Hit RayTracer::trace(const Ray& ray) const {
  const FlushDenormals flush;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit rayHit{};
  rayHit.ray = toEmbree(ray, state_->shift);
  rayHit.hit.geomID = rayHit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(state_->top.get(), &context, &rayHit);
  Hit hit;
  const RTCHit& h = rayHit.hit;
  state_->toHits<1>({&ray, 1}, &h.geomID, h.instID, &h.primID, {&hit, 1});
  return hit;
}

namespace {

template <class RayHit, auto Intersect, unsigned Width, class ToHits>
void tracePackets(RTCScene scene, std::span<const Ray> rays, std::span<Hit> hits, RayOrder order,
                  const glm::vec3& shift, const ToHits& toHits) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  if (order == RayOrder::coherent) context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  RayHit packet;
  alignas(64) int valid[Width];
  for (std::size_t first = 0; first < rays.size(); first += Width) {
    const auto count = static_cast<unsigned>(std::min<std::size_t>(Width, rays.size() - first));
    for (unsigned i = 0; i < Width; ++i) {
      valid[i] = i < count ? -1 : 0;
      putRay(packet.ray, i, rays[first + std::min(i, count - 1)], shift);
      packet.hit.geomID[i] = packet.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    }
    Intersect(valid, scene, &context, &packet);
    toHits(rays.subspan(first, count), packet.hit, hits.subspan(first, count));
  }
}

template <class Packet, auto Occluded, unsigned Width>
void occludedPackets(RTCScene scene, std::span<const Ray> rays, std::span<std::uint8_t> blocked,
                     const glm::vec3& shift) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  Packet packet;
  alignas(64) int valid[Width];
  for (std::size_t first = 0; first < rays.size(); first += Width) {
    const auto count = static_cast<unsigned>(std::min<std::size_t>(Width, rays.size() - first));
    for (unsigned i = 0; i < Width; ++i) {
      valid[i] = i < count ? -1 : 0;
      putRay(packet, i, rays[first + std::min(i, count - 1)], shift);
    }
    Occluded(valid, scene, &context, &packet);
    for (unsigned i = 0; i < count; ++i) blocked[first + i] = packet.tfar[i] < 0.0f ? 1 : 0;
  }
}

}  // namespace

void RayTracer::trace(std::span<const Ray> rays, std::span<Hit> hits, RayOrder order) const {
  const FlushDenormals flush;
  const RTCScene scene = state_->top.get();
  const State& state = *state_;
  if (state_->width == 16) {
    tracePackets<RTCRayHit16, rtcIntersect16, 16>(scene, rays, hits, order, state_->shift, [&](auto some, const auto& h, auto to) {
      state.toHits<16>(some, h.geomID, h.instID[0], h.primID, to);
    });
  } else if (state_->width == 8) {
    tracePackets<RTCRayHit8, rtcIntersect8, 8>(scene, rays, hits, order, state_->shift, [&](auto some, const auto& h, auto to) {
      state.toHits<8>(some, h.geomID, h.instID[0], h.primID, to);
    });
  } else {
    for (std::size_t i = 0; i < rays.size(); ++i) hits[i] = trace(rays[i]);
  }
}

bool RayTracer::occluded(const Ray& ray) const {
  const FlushDenormals flush;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay r = toEmbree(ray, state_->shift);
  rtcOccluded1(state_->top.get(), &context, &r);
  return r.tfar < 0.0f;
}

void RayTracer::occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded_) const {
  const FlushDenormals flush;
  const RTCScene scene = state_->top.get();
  if (state_->width == 16) {
    occludedPackets<RTCRay16, rtcOccluded16, 16>(scene, rays, occluded_, state_->shift);
  } else if (state_->width == 8) {
    occludedPackets<RTCRay8, rtcOccluded8, 8>(scene, rays, occluded_, state_->shift);
  } else {
    for (std::size_t i = 0; i < rays.size(); ++i) occluded_[i] = occluded(rays[i]) ? 1 : 0;
  }
}

const Scene& RayTracer::scene() const { return *state_->scene; }
std::string RayTracer::description() const { return state_->description; }
glm::vec3 RayTracer::boundsMin() const { return state_->boundsMin; }
glm::vec3 RayTracer::boundsMax() const { return state_->boundsMax; }

float RayTracer::epsilonAt(const glm::vec3& positionWorld) const {
  const float rounding = kEpsilonUlps * std::numeric_limits<float>::epsilon() * largest(positionWorld);
  return std::max({rounding, state_->epsilonFloor, std::numeric_limits<float>::min()});
}

}  // namespace relume
