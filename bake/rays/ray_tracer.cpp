// SPDX-License-Identifier: MIT
// Traces rays by Embree 3. Embree divides by approximate reciprocals (rcpps), whose last bits differ between makers of
// processors. So it only says which triangle a ray hits; where it hits is computed here. build_rays.cpp builds the
// structure; ray_overlaps.cpp resolves ties, where a ray meets several triangles at one point.
#include "bake/rays/ray_tracer_state.h"

#include <glm/geometric.hpp>

#include <limits>

namespace relume {
namespace {

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

}  // namespace

Corners RayTracer::State::cornersOf(unsigned id, std::uint32_t triangle) const {
  if (vertices[id] != nullptr) return cornersAt(vertices[id], triangle);
  Corners c = scene->corners(scene->instances[instance[id]], triangle);
  for (glm::vec3& corner : c) corner -= shift;
  return c;
}

// Prefetch the memory from which toHits() makes hits. [Size ids >= count]
void RayTracer::State::prefetch([[maybe_unused]] unsigned count, [[maybe_unused]] const unsigned* geomId,
                                [[maybe_unused]] const unsigned* instanceId,
                                [[maybe_unused]] const unsigned* triangle) const {
#if defined(__SSE2__)
  for (unsigned i = 0; i < count; ++i) {
    const unsigned id = idOf(geomId[i], instanceId[i]);
    if (id == RTC_INVALID_GEOMETRY_ID || vertices[id] == nullptr) continue;
    const auto* first = reinterpret_cast<const char*>(vertices[id] + 9 * static_cast<std::size_t>(triangle[i]));
    _mm_prefetch(first, _MM_HINT_T0);
    _mm_prefetch(first + sizeof(Corners) - 1, _MM_HINT_T0);
    if (!overlaps[id].empty()) _mm_prefetch(reinterpret_cast<const char*>(&overlaps[id][triangle[i]]), _MM_HINT_T0);
  }
#endif
}

// [Size rays <= Width] [Size ids = Width]
template <unsigned Width>
void RayTracer::State::toHits(std::span<const Ray> rays, const unsigned* geomId, const unsigned* instanceId,
                              const unsigned* triangle, std::span<Hit> hits) const {
  unsigned ids[Width];
  for (unsigned i = 0; i < rays.size(); ++i) ids[i] = idOf(geomId[i], instanceId[i]);
  HitPoints<Width> points;
  for (unsigned i = 0; i < Width; ++i) {
    const unsigned k = std::min<unsigned>(i, static_cast<unsigned>(rays.size()) - 1);
    const Corners c = ids[k] != RTC_INVALID_GEOMETRY_ID ? cornersOf(ids[k], triangle[k]) : Corners{};
    points.put(i, c, rays[k].origin - shift, rays[k].direction, rays[k].tMin, rays[k].tMax);
  }
  findHitPoints(points);
  for (unsigned i = 0; i < rays.size(); ++i) {
    if (ids[i] == RTC_INVALID_GEOMETRY_ID) {
      hits[i] = {};
    } else if (points.edge[i] < 0.0f || (!overlaps[ids[i]].empty() && overlaps[ids[i]][triangle[i]] != 0)) {
      hits[i] = resolveTie(rays[i], ids[i], triangle[i], points.distance[i]);
    } else {
      hits[i] = {points.distance[i], instance[ids[i]], triangle[i], points.barycentric(i), points.facing[i] > 0.0f};
    }
  }
}

RayTracer::RayTracer(std::unique_ptr<State> state) : state_(std::move(state)) {}
RayTracer::RayTracer(RayTracer&&) noexcept = default;
RayTracer& RayTracer::operator=(RayTracer&&) noexcept = default;
RayTracer::~RayTracer() = default;

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

// The triangles that rays hit lie all over memory. Prefetch those of one packet, and read them after tracing the next.
template <class RayHit, auto Intersect, unsigned Width, class Ask, class ToHits>
void tracePackets(RTCScene scene, std::span<const Ray> rays, std::span<Hit> hits, RayOrder order,
                  const glm::vec3& shift, const Ask& ask, const ToHits& toHits) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  if (order == RayOrder::coherent) context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  RayHit packets[2];
  alignas(64) int valid[Width];
  const auto countFrom = [&](std::size_t first) { return std::min<std::size_t>(Width, rays.size() - first); };
  const auto finish = [&](std::size_t first) {
    toHits(rays.subspan(first, countFrom(first)), packets[first / Width % 2].hit, hits.subspan(first));
  };
  for (std::size_t first = 0; first < rays.size(); first += Width) {
    RayHit& packet = packets[first / Width % 2];
    const auto count = static_cast<unsigned>(countFrom(first));
    for (unsigned i = 0; i < Width; ++i) {
      valid[i] = i < count ? -1 : 0;
      putRay(packet.ray, i, rays[first + std::min(i, count - 1)], shift);
      packet.hit.geomID[i] = packet.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    }
    Intersect(valid, scene, &context, &packet);
    ask(count, packet.hit);
    if (first > 0) finish(first - Width);
  }
  if (!rays.empty()) finish((rays.size() - 1) / Width * Width);
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
  const auto ask = [&](unsigned count, const auto& h) { state.prefetch(count, h.geomID, h.instID[0], h.primID); };
  if (state_->width == 16) {
    tracePackets<RTCRayHit16, rtcIntersect16, 16>(
        scene, rays, hits, order, state_->shift, ask,
        [&](auto some, const auto& h, auto to) { state.toHits<16>(some, h.geomID, h.instID[0], h.primID, to); });
  } else if (state_->width == 8) {
    tracePackets<RTCRayHit8, rtcIntersect8, 8>(
        scene, rays, hits, order, state_->shift, ask,
        [&](auto some, const auto& h, auto to) { state.toHits<8>(some, h.geomID, h.instID[0], h.primID, to); });
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
RayGeometry RayTracer::geometry() const { return state_->geometry; }
std::string RayTracer::description() const { return state_->description; }
glm::vec3 RayTracer::boundsMin() const { return state_->boundsMin; }
glm::vec3 RayTracer::boundsMax() const { return state_->boundsMax; }

float RayTracer::epsilonAt(const glm::vec3& positionWorld) const {
  const float ulps = state_->shift == glm::vec3(0.0f) ? kEpsilonUlps : kFarEpsilonUlps;
  const float rounding = ulps * std::numeric_limits<float>::epsilon() * largest(positionWorld);
  return std::max({rounding, state_->epsilonFloor, std::numeric_limits<float>::min()});
}

}  // namespace relume
