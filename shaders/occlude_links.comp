// SPDX-License-Identifier: MIT
// What moving parts hide of the links of each cache, and what they give in its place: OccludeLinks of
// runtime/cpu/occlude_links.h, which says how and which a test compares. The change is two cones of light a cache, of what
// is near and of lamps farther off, which light_caches.comp adds to its sums, in this frame and until the cache's next
// turn. A work group of RELUME_THREADS lists those of its RELUME_CACHES caches that are near a part, or in a lamp's reach,
// and have their turn. Then it cuts the links of each into RELUME_LANES shares, which its threads take in turn: in a first
// round for what is near, in one more for each lamp. RELUME_LINK_KIND: lib/link_sums.glsl.
#include "shared/layout.h"
#include "lib/pack.glsl"
#include "lib/color.glsl"
#include "lib/link_sums.glsl"

#ifdef RELUME_VULKAN
layout(constant_id = 0) const uint RELUME_THREADS = 1u;
layout(constant_id = 1) const uint RELUME_CACHES = 1u;
layout(constant_id = 2) const int RELUME_NODE_STEPS = 0;
layout(constant_id = 3) const uint RELUME_LANES = 1u;
layout(local_size_x_id = 0) in;
#else
layout(local_size_x = RELUME_THREADS) in;
#endif

RELUME_PARAMETERS(RELUME_OCCLUDE_PARAMETERS)

#if RELUME_LINK_KIND == RELUME_LINKS_REPACKED
#define RELUME_ROW_WORDS (1 + (RELUME_NODE_STEPS + 1) / 2)
#define RELUME_ROW_LINKS 4u
layout(std430, binding = RELUME_SLOT_LINKS) readonly buffer Links { uvec4 linkWords[]; };
#else
#define RELUME_ROW_WORDS 1
#define RELUME_ROW_LINKS 1u
layout(std430, binding = RELUME_SLOT_LINKS) readonly buffer Links { uint linkWord[]; };
#endif
#if RELUME_LINK_KIND == RELUME_LINKS_SH || RELUME_LINK_KIND == RELUME_LINKS_OCT6 || RELUME_LINK_KIND == RELUME_LINKS_REPACKED
layout(std430, binding = RELUME_SLOT_LINK_SHAPE) readonly buffer LinkShape { uint linkShapeWord[]; };
#endif
#define RELUME_KNOWS_DIRECTIONS (RELUME_LINK_KIND != RELUME_LINKS_SH && RELUME_LINK_KIND != RELUME_LINKS_IRRADIANCE)
layout(std430, binding = RELUME_SLOT_ROWS) readonly buffer Rows { uint rowWord[]; };
layout(std430, binding = RELUME_SLOT_NODES) readonly buffer Nodes { uint node[]; };
layout(std430, binding = RELUME_SLOT_PARTS) readonly buffer Parts { RelumePart part[]; };
layout(std430, binding = RELUME_SLOT_SENDER_POINTS) readonly buffer Points { uint pointWord[]; };
layout(std430, binding = RELUME_SLOT_SHAPES) readonly buffer Shapes { uint shapeWord[]; };
layout(std430, binding = RELUME_SLOT_MOVING_LIGHT) buffer MovingLight { vec4 movingLight[]; };

#include "lib/near_parts.glsl"
#include "lib/shape_march.glsl"

// The constants of runtime/cpu/occlude_links.cpp.
const float kSolidAngle = kPi / 0.282094792;
const float kSenderEnd = 0.999, kMostFarScale = 4.0;
const uint kMostRays = 8u;

// A place on a sender: [m], of the sky a unit direction.
struct Point {
  vec3 place, normal;  // normal: 127 times the surfel's
  bool isSky;
};

// Point i of n that are spread over those of a node.
Point pointOf(uint sender, uint i, uint n) {
  uint first = pointWord[2u * sender], count = pointWord[2u * sender + 1u];
  uint at = relumePoints + 4u * (first + (2u * i + 1u) * count / (2u * n)), bits = pointWord[at + 3u];
  vec3 normal = vec3(int(bits << 24) >> 24, int(bits << 16) >> 24, int(bits << 8) >> 24);
  return Point(uintBitsToFloat(uvec3(pointWord[at], pointWord[at + 1u], pointWord[at + 2u])), normal, bits >> 24 != 0u);
}

// Share of a cone about an axis at an angle of this cosine, `along`, that another covers.
float coveredShare(float along, float cosine, Cone cone) {
  cosine = clamp(cosine, -0.9995, 0.9995);
  float c = cone.cosine * cosine, s = cone.sine * sqrt(1.0 - cosine * cosine);
  return min((along - c + s) / (2.0 * s), 1.0) * (1.0 - cone.cosine) / (1.0 - c);
}

// Whether cones meet, or nearly do: those of links stand for clusters of any form, and their directions are rounded.
bool meets(float along, float cosine, Cone cone) {
  cosine = clamp(cosine, -0.9995, 0.9995);
  float wide = isFar ? cosine : max(1.25 * cosine - 0.29, -1.0), wide2 = max(1.0 - wide * wide, 1e-6);
  return along >= cone.cosine * wide - cone.sine * sqrt(wide2) || wide <= -cone.cosine;
}

vec3 toGrid(uint number, vec3 direction) {
  return direction.x * part[number].toGridX + direction.y * part[number].toGridY + direction.z * part[number].toGridZ;
}

// Radiosity that a ray of this direction in the shape's axes meets in a voxel at a distance [m]: that of the patch which
// faces it most, of the voxel's box.
vec3 radiosityAt(uint number, ivec3 v, vec3 direction, float distance_) {
  uint shape = part[number].shape;
  ivec3 box = v >> 3;
  ivec2 boxes = ivec2(shapeWord[shape + RELUME_SHAPE_BOXES], shapeWord[shape + RELUME_SHAPE_BOXES + 1u]);
  uint first = shapeWord[shape + RELUME_SHAPE_PATCH_OF] + 6u * uint((box.z * boxes.y + box.y) * boxes.x + box.x);
  uint patches = shapeWord[shape + RELUME_SHAPE_PATCHES], found = number;
  float best = 0.0;
  for (uint i = 0u; i < 6u; ++i) {
    uint each = shapeWord[first + i];
    if (each == kRelumeNone) continue;
    uint at = patches + RELUME_SHAPE_PATCH_WORDS * each + RELUME_PATCH_NORMAL;
    float facing = -dot(direction, uintBitsToFloat(uvec3(shapeWord[at], shapeWord[at + 1u], shapeWord[at + 2u])));
    if (facing <= best) continue;
    best = facing;
    found = part[number].firstPatch + each;
  }
  uint light = relumeFirstLight + 2u * found;
  return movingLight[light].rgb + distance_ / (distance_ + 0.3 * part[number].radius) * movingLight[light + 1u].rgb;
}

// Whether a ray meets a part before `end`, which becomes the distance of the first, and the radiosity there.
bool meetsPart(vec3 direction, inout float end, out vec3 radiosity) {
  bool isMet = false;
  radiosity = vec3(0.0);
  for (uint w = 0u; 32u * w < relumePartCount; ++w) {
    for (uint bits = nearPart[w]; bits != 0u; bits &= bits - 1u) {
      uint number = 32u * w + uint(findLSB(bits));
      vec3 offset = part[number].centre - place;
      float along = dot(offset, direction), radius = part[number].radius, ball = part[number].ball, d2 = dot(offset, offset);
      bool isBall = ball > 0.0 && d2 > ball * ball;
      if (isBall) radius = ball;
      vec3 toRay = offset - along * direction;
      float inside2 = radius * radius - dot(toRay, toRay);  // half the chord, squared
      if (!(inside2 > 0.0)) continue;
      float half_ = sqrt(inside2);
      if (along + half_ <= 0.0 || along - half_ >= end) continue;
      vec3 inGrid = toGrid(number, direction);
      vec3 origin = toGrid(number, place - part[number].origin) - part[number].gridOrigin;
      ivec3 v;
      float t;
      if (isBall) {
        t = along - half_;
        uint shape = part[number].shape;
        ivec3 size = 4 * ivec3(shapeWord[shape], shapeWord[shape + 1u], shapeWord[shape + 2u]);
        v = clamp(ivec3(origin + t * inGrid), ivec3(0), size - 1);
      } else if (!march(part[number].shape, origin, inGrid, min(end, along + 1.1 * half_), v, t)) {
        continue;
      }
      end = t;
      radiosity = radiosityAt(number, v, inGrid, t);
      isMet = true;
    }
  }
  return isMet;
}

// What parts hide of a link: its share, and times that the radiosity that is there in its place and the directions.
struct Hidden {
  float share;
  vec3 radiosity, direction;
};

// Rays to places on a node; those that the cache or the sender turns its back on do not count.
Hidden look(uint sender, uint rays) {
  Hidden hidden = Hidden(0.0, vec3(0.0), vec3(0.0));
  float all_ = 0.0;
  for (uint i = 0u; i < rays; ++i) {
    Point point = pointOf(sender, i, rays);
    vec3 direction = point.place;
    float size = kNever, weight = 1.0;
    if (!point.isSky) {
      vec3 way = point.place - place;
      float d2 = dot(way, way);
      size = sqrt(d2);
      direction = way / size;
      if (rays > 1u) weight = -dot(point.normal, direction) / d2;
    }
    if (onMap && rays > 1u) {
      float cosine = dot(cacheNormal, direction);
      if (!(cosine > 0.0)) continue;
#if RELUME_LINK_KIND == RELUME_LINKS_IRRADIANCE
      weight *= cosine;
#endif
    }
    if (!(weight > 0.0)) continue;
    all_ += weight;
    float end = kSenderEnd * size;
    vec3 radiosity;
    if (!meetsPart(direction, end, radiosity)) continue;
    hidden.share += weight;
    hidden.radiosity += weight * radiosity;
    hidden.direction += weight * direction;
  }
  if (!(hidden.share > 0.0)) return hidden;
  return Hidden(hidden.share / all_, hidden.radiosity / all_, hidden.direction / all_);
}

// What a part far off hides of its sphere, by a view of it, and the distance of what is seen.
Hidden viewFrom(uint number, Cone cone, out float distance_) {
  // viewAlong() of runtime/moving/shape_views.h.
  vec3 way = toGrid(number, place - part[number].centre);
  float sum = abs(way.x) + abs(way.y) + abs(way.z);
  vec2 p = sum > 0.0 ? way.xy / sum : vec2(0.0);
  if (way.z < 0.0) p = (1.0 - abs(p.yx)) * mix(vec2(1.0), vec2(-1.0), lessThan(p, vec2(0.0)));
  ivec2 at = clamp(ivec2((0.5 * float(RELUME_VIEW_SIDE)) * (p + 1.0)), ivec2(0), ivec2(RELUME_VIEW_SIDE - 1u));
  uint view = relumeFirstView + 2u * (RELUME_VIEWS * number + uint(at.y) * RELUME_VIEW_SIDE + uint(at.x));
  vec4 own = movingLight[view], bounced = movingLight[view + 1u];
  distance_ = max(distance(part[number].centre, place) - bounced.w, 0.0);
  return Hidden(own.w, own.rgb + distance_ / (distance_ + 0.3 * part[number].radius) * bounced.rgb, cone.axis);
}

// By what the links toward a far part, which leave gaps and overlap, take too little or too much: found of the transfer
// that it covers.
float farScale(float found) {
  Cone cone = coneToward(lastNear);
  vec3 offset = part[lastNear].centre - place;
  float distance_, radius = part[lastNear].radius, cosine = sqrt(1.0 - radius * radius / dot(offset, offset));
  float wanted = viewFrom(lastNear, cone, distance_).share * 2.0 * kPi * (1.0 - cosine) / kSolidAngle;
  if (onMap) {
    float height = dot(cacheNormal, offset);
    if (height < radius) return 1.0;  // not all of it is above the horizon
#if RELUME_LINK_KIND == RELUME_LINKS_IRRADIANCE
    wanted *= 2.0 * height / length(offset);
#endif
  }
  return min(wanted / found, kMostFarScale);
}

// Whether the plane of a sender crosses the axis of a cone beyond a distance; of one seen from the side the sender counts.
bool isBehind(Point sender, Cone cone, float distance_) {
  if (sender.isSky) return true;
  vec3 way = sender.place - place;
  float facing = dot(sender.normal, cone.axis);
  if (facing < -12.7) return dot(sender.normal, way) < distance_ * facing;
  return dot(way, way) > distance_ * distance_;
}

struct Link {
  uint sender;
  float transfer;
  vec3 direction;  // and the cosine of its cone, of links that know them
  float cosine;
};

// Link i of the row that begins at `begin` of what is bound.
Link readLink(uint record, uint begin, uint i) {
  Link link = Link(0u, 0.0, vec3(0.0), 0.0);
#if RELUME_LINK_KIND == RELUME_LINKS_SH
  link.sender = linkWord[relumeWordOffset + begin + i];
  uint at = relumeHalfOffset + (begin + i) * relumeShapeStride;
  vec2 pair = unpackHalf2x16(linkShapeWord[at >> 1]);
  link.transfer = (at & 1u) == 0u ? pair.x : pair.y;
#elif RELUME_LINK_KIND == RELUME_LINKS_CONE
  uint at = relumeWordOffset + 3u * (begin + i);
  vec2 transfer = unpackHalf2x16(linkWord[at + 1u]);
  link = Link(linkWord[at], transfer.x, relumeUnpackOctahedral(linkWord[at + 2u]), transfer.y);
#elif RELUME_LINK_KIND == RELUME_LINKS_REPACKED
  uint four = begin + (i >> 2), word = linkWords[(relumeWordOffset >> 2) + four][i & 3u];
  uint transfers = linkShapeWord[(relumeHalfOffset >> 1) + four] >> (8u * (i & 3u)) & 0xFFu;
  link.sender = word & 0xFFFFu;
  for (uint k = 0u; k < uint(RELUME_NODE_STEPS); ++k)
    link.sender += i >= ((rowWord[record + 1u + (k >> 1)] >> (16u * (k & 1u))) & 0xFFFFu) ? 0x10000u : 0u;
  link.transfer = unpackHalf2x16(transfers << 6).x;
  link.direction = relumeUnpackDirection(word >> 16, 6);
  link.cosine = relumeUnpackCone(word >> 16, 12, 4);
#else
  uint head = linkWord[relumeWordOffset + begin + i];
  link.sender = head & 0xFFFFFu;
  link.transfer = relumeUnpackTransfer(head);
#if RELUME_LINK_KIND == RELUME_LINKS_OCT6
  uint at = relumeHalfOffset + begin + i, bits = (linkShapeWord[at >> 1] >> (16u * (at & 1u))) & 0xFFFFu;
  link.direction = relumeUnpackDirection(bits, 6);
  link.cosine = relumeUnpackCone(bits, 12, 4);
#endif
#endif
  return link;
}

// Whether a part may hide a link; share: of it that the sphere around the last part covers.
bool isToward(Link link, out float share) {
  share = 0.0;
#if !RELUME_KNOWS_DIRECTIONS
  // The middle of the sender, and a cone by what it transfers.
  Point middle = pointOf(link.sender, 0u, 1u);
  link.direction = middle.isSky ? middle.place : normalize(middle.place - place);
  float solidAngle = kSolidAngle * link.transfer;
#if RELUME_LINK_KIND == RELUME_LINKS_IRRADIANCE
  // f = 2 y_0 * share of the irradiance: the cosine is in it
  if (onMap) solidAngle *= 0.5 / max(dot(cacheNormal, link.direction), 0.1);
#endif
  link.cosine = 1.0 - solidAngle / (2.0 * kPi);
#endif
  for (uint w = 0u; 32u * w < relumePartCount; ++w) {
    for (uint bits = nearPart[w]; bits != 0u; bits &= bits - 1u) {
      uint number = 32u * w + uint(findLSB(bits));
      if (isAround(number)) return true;
      Cone cone = coneToward(number);
      float along = dot(cone.axis, link.direction);
      share = coveredShare(along, link.cosine, cone);
#if RELUME_KNOWS_DIRECTIONS
      if (meets(along, link.cosine, cone)) return true;
#else
      if (share > -1.0) return true;
#endif
    }
  }
  return false;
}

// Of the group, the caches that are looked at, and what each share of their links changes: most is the luma that is
// hidden of one sender, and its number.
shared uint nearCaches, rounds;
shared uint nearCache[RELUME_CACHES];
shared vec4 partial[RELUME_CACHES][RELUME_LANES][2];
shared vec2 partialMost[RELUME_CACHES][RELUME_LANES];

float lumaOf(uint sender) { return relumeRgbToYCoCg(relumeUnpackColor(node[sender])).x; }

// What the links `first`, `first` + RELUME_LANES .. of a cache lose and gain. color: RGB, transfer; direction: times
// transfer, and transfer that the sphere covers of senders before a far part, times the share of it that the part fills.
void changeOf(uint cache, uint first, out vec4 color, out vec4 direction, out vec2 most) {
  color = direction = vec4(0.0);
  most = vec2(0.0, kNever);
  float distance_ = 0.0;
  Hidden far = Hidden(0.0, vec3(0.0), vec3(0.0));
  Cone cone = coneToward(lastNear);
  if (isFar) far = viewFrom(lastNear, cone, distance_);
  uint record = cache * uint(RELUME_ROW_WORDS);
  uint begin = rowWord[record] - relumeFirstLink, end = rowWord[record + uint(RELUME_ROW_WORDS)] - relumeFirstLink;
  uint count = nearCount == 0u || (isFar && far.share == 0.0) ? 0u : RELUME_ROW_LINKS * (end - begin);
  // Find the links that parts may hide, 32 at a time, then look at those alone: software drivers run what is behind a
  // branch for all threads.
  for (uint chunk = first; chunk < count; chunk += 32u * uint(RELUME_LANES)) {
    uint toward = 0u;
    for (uint k = 0u; k < 32u; ++k) {
      uint i = chunk + k * uint(RELUME_LANES);
      if (i >= count) break;
      float share;
      Link link = readLink(record, begin, i);
      if (link.transfer > 0.0 && isToward(link, share) && !(isFar && share <= 0.0)) toward |= 1u << k;
    }
    for (; toward != 0u; toward &= toward - 1u) {
      Link link = readLink(record, begin, chunk + uint(findLSB(toward)) * uint(RELUME_LANES));
      Hidden hidden;
      if (isFar) {
        float share;
        isToward(link, share);
        share *= far.share;
        hidden = Hidden(share, share * far.radiosity, share * far.direction);
        if (!isBehind(pointOf(link.sender, 0u, 1u), cone, distance_)) {
          direction.w += link.transfer * share;
          continue;
        }
      } else {
        float wanted = min(kSolidAngle * link.transfer * rayDensity, float(kMostRays));
        uint points = pointWord[2u * link.sender + 1u];
        hidden = look(link.sender, clamp(uint(wanted), 1u, min(points, kMostRays)));
        if (hidden.share == 0.0) continue;
      }
      vec3 taken = link.transfer * hidden.share * relumeUnpackColor(node[link.sender]);
      color.rgb += link.transfer * hidden.radiosity - taken;
      float luma = relumeRgbToYCoCg(taken).x;
      if (luma > most.x || (luma == most.x && float(link.sender) < most.y)) most = vec2(luma, float(link.sender));
      color.w += link.transfer * hidden.share;
      direction.xyz += link.transfer * hidden.direction;
    }
  }
  color.rgb *= nearWeight;
}

void takeRound(uint cache, uint round) {
  placeAt(cache);
  findNear();
  if (round > 0u) takeLamp(round);
}

// What a round's shares sum up to, stored for the cache.
void finishRound(uint row, uint round) {
  vec4 color = vec4(0.0), direction = vec4(0.0);
  vec2 most = vec2(0.0, kNever);
  for (uint lane = 0u; lane < uint(RELUME_LANES); ++lane) {
    color += partial[row][lane][0];
    direction += partial[row][lane][1];
    vec2 each = partialMost[row][lane];
    if (each.x > most.x || (each.x == most.x && each.y < most.y)) most = each;
  }
  uint cache = nearCache[row], at = RELUME_CHANGE_WORDS * cache;
  // Cones are wider than their senders: a far part most of which is hidden is left out.
  bool changes = color.w > direction.w;
  vec3 changed = vec3(0.0);
  if (changes) {
    takeRound(cache, round);
    changed = relumeRgbToYCoCg(color.rgb);
    if (isFar) changed *= farScale(color.w + direction.w);
    direction.xyz /= color.w;
  }
  if (round == 0u) {
    movingLight[at] = vec4(changed, changes ? lumaOf(uint(most.y)) : 0.0);
    movingLight[at + 1u] = changes ? vec4(direction.xyz, most.y) : vec4(vec3(0.0), RELUME_CHANGE_NONE);
    movingLight[at + 2u] = movingLight[at + 3u] = vec4(0.0);
  } else if (changes) {
    movingLight[at + 2u].rgb += changed;
    movingLight[at + 3u] += abs(changed.x) * vec4(direction.xyz, 1.0);
  }
}

void main() {
  uint thread = gl_LocalInvocationID.x, first = relumeFirstCache + gl_WorkGroupID.x * uint(RELUME_CACHES);
  if (thread == 0u) {
    nearCaches = 0u;
    rounds = 1u;
  }
  barrier();
  for (uint i = thread; i < uint(RELUME_CACHES); i += uint(RELUME_THREADS)) {
    uint cache = first + i, state = RELUME_CHANGE_WORDS * cache + 1u;
    if (cache >= relumeEndCache) break;
    placeAt(cache);
    if (!findNear()) {
      movingLight[state].w = RELUME_CHANGE_NOT_NEAR;
    } else if (relumeFrame == 0u || hasTurn(cache) || movingLight[state].w == RELUME_CHANGE_NOT_NEAR) {
      nearCache[atomicAdd(nearCaches, 1u)] = cache;
      atomicMax(rounds, 1u + lampCount);
    }
  }
  barrier();
  uint tasks = nearCaches * uint(RELUME_LANES), lastRound = rounds;
  for (uint round = 0u; round < lastRound; ++round) {
    for (uint task = thread; task < tasks; task += uint(RELUME_THREADS)) {
      uint row = task / uint(RELUME_LANES), lane = task % uint(RELUME_LANES), cache = nearCache[row];
      takeRound(cache, round);
      changeOf(cache, lane, partial[row][lane][0], partial[row][lane][1], partialMost[row][lane]);
    }
    barrier();
    for (uint row = thread; row < nearCaches; row += uint(RELUME_THREADS)) finishRound(row, round);
    barrier();
  }
}
