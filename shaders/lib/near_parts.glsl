// SPDX-License-Identifier: MIT
// Which moving parts a thread's cache looks at: findNear() and LookTurns of runtime/cpu/occlude_links.cpp and
// runtime/shared/look_turns.h. What includes it has declared part[] and pointWord[].
const float kPi = 3.14159265, kNever = 1e30, kRays = 8.0;
const float kMinCosine = 1.0 - 0.02 / (2.0 * kPi), kMinShare = 1.0 - kMinCosine * kMinCosine;
const vec2 kOwnSpace = vec2(1.5, 3.0);
const float kFarSolidAngle = 0.06, kFarBallSolidAngle = 2.0;
// At most kMaxMovingParts parts, 32 a word.
const uint kPartWords = 8u;

// Of this thread's cache, and of the parts that it looks at.
vec3 place, cacheNormal;
bool onMap;
uint nearPart[kPartWords], lampPart[kPartWords];
uint nearCount, lastNear, lampCount;
float nearWeight, rayDensity, covered;
bool isFar;

void placeAt(uint cache) {
  uint at = relumePlaces + 6u * cache;
  place = uintBitsToFloat(uvec3(pointWord[at], pointWord[at + 1u], pointWord[at + 2u]));
  cacheNormal = uintBitsToFloat(uvec3(pointWord[at + 3u], pointWord[at + 4u], pointWord[at + 5u]));
  onMap = cacheNormal != vec3(0.0);
}

// The directions toward the sphere around a part.
struct Cone {
  vec3 axis;
  float cosine, sine;
};

Cone coneToward(uint number) {
  vec3 offset = part[number].centre - place;
  float d2 = dot(offset, offset), d = sqrt(d2), radius = part[number].radius;
  // Of lamps that are not near a wider one: links leave gaps between their cones.
  float share = clamp(radius * radius / d2, kMinShare, 1.0);
  return Cone(d > 0.0 ? offset / d : vec3(0.0), sqrt(1.0 - share), sqrt(share));
}

bool isAround(uint number) {
  vec3 offset = part[number].centre - place;
  return !(part[number].radius * part[number].radius < dot(offset, offset));
}

// lampWeight() of runtime/shared/look_turns.h.
float lampWeight(uint number, vec3 offset, float d2, float r2) {
  float least = part[number].least;
  if (r2 > kMinShare * d2 || !(r2 > least * d2)) return 0.0;
  if (onMap && dot(cacheNormal, offset) <= 0.0) return 0.0;
  return min(r2 / (least * d2) - 1.0, 1.0);
}

bool findNear() {
  nearCount = lampCount = 0u;
  nearWeight = 1.0;
  covered = 0.0;
  float smallest = 1.0;
  for (uint w = 0u; w < kPartWords; ++w) nearPart[w] = lampPart[w] = 0u;
  for (uint i = 0u; i < relumePartCount; ++i) {
    vec3 offset = part[i].centre - place;
    float radius = part[i].radius, d2 = dot(offset, offset), r2 = radius * radius;
    if (!(r2 > kMinShare * d2)) {
      if (lampWeight(i, offset, d2, r2) > 0.0) {
        lampPart[i >> 5] |= 1u << (i & 31u);
        ++lampCount;
      }
      continue;
    }
    if (onMap) {
      if (dot(cacheNormal, offset) <= -radius) continue;
    } else {
      // What reads the grid so near to a part is mostly the part itself.
      if (d2 <= kOwnSpace.x * kOwnSpace.x * r2) continue;
      float own = sqrt(d2 / r2) - kOwnSpace.x;
      nearWeight = min(nearWeight, own / (kOwnSpace.y - kOwnSpace.x));
    }
    nearPart[i >> 5] |= 1u << (i & 31u);
    lastNear = i;
    ++nearCount;
    smallest = min(smallest, r2 / d2);
    covered += r2 < d2 ? r2 / d2 : 1.0;
  }
  rayDensity = kRays / (kPi * smallest);
  isFar = nearCount == 1u && kPi * smallest < (part[lastNear].ball > 0.0 ? kFarBallSolidAngle : kFarSolidAngle);
  return nearCount + lampCount > 0u;
}

// After findNear(): look at a lamp alone, in its round.
void takeLamp(uint round) {
  nearCount = 0u;
  for (uint w = 0u; w < kPartWords; ++w) {
    nearPart[w] = 0u;
    for (uint bits = lampPart[w]; bits != 0u; bits &= bits - 1u) {
      if (--round != 0u) continue;
      nearPart[w] = bits & -bits;
      nearCount = 1u;
      lastNear = 32u * w + uint(findLSB(bits));
    }
  }
  if (nearCount == 0u) return;
  vec3 offset = part[lastNear].centre - place;
  float radius = part[lastNear].radius;
  nearWeight = lampWeight(lastNear, offset, dot(offset, offset), radius * radius);
  isFar = true;
}

// LookTurns::hasTurn() of runtime/shared/look_turns.h.
bool hasTurn(uint cache) {
  uint period = 1u;
  while (period < relumeLag && 2.0 * float(period) * covered <= relumeEachFrame) period *= 2u;
  return ((((cache * 0x9E3779B9u) >> 26) + relumeFrame) & (period - 1u)) == 0u;
}
