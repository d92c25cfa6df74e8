// SPDX-License-Identifier: MIT
// What a radiance record adds to a pixel that mirrors (RCS Eqs. (5), (9)): w_k times the light in the pixel's lobe, w_k,
// and w_k times what the lobe would have in a uniform world of radiance 1 (bake/preview/radiance_records.h).
//
// Deviation: the CPU turns three channels of coefficients, and a uniform world's, into the pixel's frame. Here the lobe
// is turned into the record's, once: all turns and tilts are the transposes of those, in reverse.
//
// RELUME_SPLAT_ORDER: [1..10] of the harmonics.
#include "shared/layout.h"
#include "lib/splat_weight.glsl"

layout(binding = RELUME_SPLAT_UNIT_LOBE) uniform sampler2D relumeLobe;
layout(location = RELUME_SPLAT_AT_MAX_TILT) uniform int maxTilt;
layout(std430, binding = RELUME_SPLAT_SLOT_RADIANCE) readonly buffer Radiance { float relumeRadiance[]; };
layout(std430, binding = RELUME_SPLAT_SLOT_TILTS) readonly buffer Tilts { float relumeTilts[]; };
layout(std430, binding = RELUME_SPLAT_SLOT_LOBES) readonly buffer Lobes { float relumeLobes[]; };

flat in vec4 recordLight[RELUME_SPLAT_MIRROR_LIGHTS];

layout(location = 0) out vec4 lightSum;
layout(location = 1) out vec4 uniformSum;

const int kOrder = RELUME_SPLAT_ORDER, kCount = kOrder * kOrder;
const int kEven = kOrder * (kOrder + 1) / 2, kOdd = kCount - kEven;  // functions of m >= 0, of m < 0
const int kAngles = 64, kExponents = 24;                             // LobeTable's
const float kMaxExponent = 20.0, kUntilted = 1e-4, kPi = 3.14159265358979;

float lobe[kCount];  // c_lm; H_l^m has index l*l + l + m

// turnHsh() of bake/preview/hsh.cpp.
void turnLobe(float cosPsi, float sinPsi) {
  float cosine = 1.0, sine = 0.0;
  for (int m = 1; m < kOrder; ++m) {
    float next = cosine * cosPsi - sine * sinPsi;
    sine = sine * cosPsi + cosine * sinPsi;
    cosine = next;
    for (int l = m; l < kOrder; ++l) {
      float a = lobe[l * l + l + m], b = lobe[l * l + l - m];
      lobe[l * l + l + m] = a * cosine + b * sine;
      lobe[l * l + l - m] = b * cosine - a * sine;
    }
  }
}

// LobeTable::evaluate(), for an axis in the pixel's frame.
void readLobe(float exponent, vec3 axis) {
  float ratio = exponent > 1.0 ? log(exponent) / log(kMaxExponent) : 0.0;
  float e = clamp(ratio, 0.0, 1.0) * float(kExponents - 1);
  float a = clamp(acos(clamp(axis.z, 0.0, 1.0)) / (0.5 * kPi), 0.0, 1.0) * float(kAngles - 1);
  int lowE = min(int(e), kExponents - 2), lowA = min(int(a), kAngles - 2);
  float next = e - float(lowE), beyond = a - float(lowA);
  int entry = (lowE * kAngles + lowA) * kEven, above = entry + kAngles * kEven;
  for (int i = 0; i < kCount; ++i) lobe[i] = 0.0;
  int at = 0;
  for (int l = 0; l < kOrder; ++l) {
    for (int m = 0; m <= l; ++m, ++at) {
      lobe[l * l + l + m] = (1.0 - next) * ((1.0 - beyond) * relumeLobes[entry + at] +
                                            beyond * relumeLobes[entry + kEven + at]) +
                            next * ((1.0 - beyond) * relumeLobes[above + at] + beyond * relumeLobes[above + kEven + at]);
    }
  }
  float across = sqrt(axis.x * axis.x + axis.y * axis.y);
  if (across > 0.0) turnLobe(axis.x / across, -axis.y / across);
}

// The transpose of HshTilt::apply().
void tiltLobe(float angle) {
  float deg = clamp(degrees(angle), 0.0, float(maxTilt));
  int low = int(deg);
  float share = deg - float(low);
  int stride = kEven * kEven + kOdd * kOdd, table = low * stride, next = share > 0.0 ? table + stride : table;
  float before[kCount];
  for (int i = 0; i < kCount; ++i) before[i] = lobe[i];
  for (int half_ = 0; half_ < 2; ++half_) {
    int size = half_ == 0 ? kEven : kOdd;
    // Functions of this half in the order of the table: column l, m; row k, n.
    int column = 0;
    for (int l = half_; l < kOrder; ++l) {
      for (int m = half_ == 0 ? 0 : -l; m <= (half_ == 0 ? l : -1); ++m, ++column) {
        float sum = 0.0;
        int row = column;
        for (int k = half_; k < kOrder; ++k) {
          for (int n = half_ == 0 ? 0 : -k; n <= (half_ == 0 ? k : -1); ++n, row += size)
            sum += mix(relumeTilts[table + row], relumeTilts[next + row], share) * before[k * k + k + n];
        }
        lobe[l * l + l + m] = sum;
      }
    }
    table += kEven * kEven;
    next += kEven * kEven;
  }
}

// frameAbout() of formats/frame_about.h.
mat3 frameAbout(vec3 n) {
  float s = n.z < 0.0 ? -1.0 : 1.0, a = -1.0 / (s + n.z), b = n.x * n.y * a;
  return mat3(vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x), vec3(b, s + n.y * n.y * a, -n.y), n);
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 facing = texelFetch(relumeFacing, pixel, 0);
  vec3 offset = texelFetch(relumePlace, pixel, 0).xyz - recordPosition.xyz;
  float squared, w = 0.0;
  if (isReached(offset, squared) && facing.xyz != vec3(0.0)) w = weightOf(offset, squared, facing.xyz, facing.w);
  vec3 light = vec3(0.0);
  // Once or never: splat_records.frag says why this is a loop.
  int count = w > 0.0 ? 1 : 0;
  for (int once = 0; once < count; ++once) {
    vec3 n = recordNormal.xyz, tangent = recordLight[0].xyz, bitangent = recordLight[1].xyz;
    mat3 frame = frameAbout(facing.xyz);
    vec4 mirror = texelFetch(relumeLobe, pixel, 0);
    readLobe(mirror.w, mirror.xyz * frame);

    // Toward where the receiver's normal leans: +X of both frames, between which there is then a tilt about +Y alone.
    float cosine = clamp(dotOf(n, frame[2]), -1.0, 1.0);
    vec3 across = frame[2] - cosine * n;
    float sine = length(across);
    bool tilts = sine > kUntilted;
    vec3 lean = tilts ? across / sine : normalize(frame[0] - n * dotOf(frame[0], n));
    vec3 leanHere = tilts ? cosine * lean - sine * n : frame[0];
    turnLobe(dotOf(leanHere, frame[0]), dotOf(leanHere, frame[1]));
    if (tilts) tiltLobe(atan(sine, cosine));
    turnLobe(dotOf(lean, tangent), -dotOf(lean, bitangent));

    offset *= recordNormal.w;
    vec2 along = vec2(dotOf(offset, tangent), dotOf(offset, bitangent));
    int first = int(recordLight[0].w) * 9 * kCount;
    for (int c = 0; c < 3; ++c) {
      float sum = 0.0;
      for (int i = 0; i < kCount; ++i) {
        int at = first + c * kCount + i;
        sum += lobe[i] * (relumeRadiance[at] + along.x * relumeRadiance[at + 3 * kCount] +
                          along.y * relumeRadiance[at + 6 * kCount]);
      }
      light[c] = sum;
    }
  }
  if (!(w > 0.0)) discard;
  lightSum = vec4(w * light, w);
  uniformSum = vec4(w * sqrt(2.0 * kPi) * lobe[0], 0.0, 0.0, 0.0);
}
