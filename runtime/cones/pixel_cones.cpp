// SPDX-License-Identifier: MIT
// See pixel_cones.h.
#include "runtime/cones/pixel_cones.h"

#include "formats/frame_about.h"
#include "formats/limits.h"
#include "runtime/shared/chunks.h"
#include "runtime/shared/stopwatch.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <cmath>
#include <new>
#include <numbers>

namespace relume {
namespace {

constexpr float kSameNormal = 0.9f, kSamePlane = 0.02f;  // cosine; share of depth
constexpr int kReach = 2;                                // pixels of the pattern around one
constexpr int kRadius = 8;                               // [pixels] of the blur
constexpr float kSigma = 4.0f;                           // [pixels]

Error pixelConesError(const std::string& what) { return {ErrorCode::usage, "cones of pixels: " + what}; }

// Whether two places are of one surface: their normals agree, and each lies in the plane of the other.
bool isSame(const glm::vec3& position, const glm::vec3& normal, float depth, const glm::vec3& otherPosition,
            const glm::vec3& otherNormal, float otherDepth) {
  if (depth == 0.0f || otherDepth == 0.0f) return depth == otherDepth;
  const glm::vec3 across = otherPosition - position;
  const float most = kSamePlane * std::min(depth, otherDepth);
  return glm::dot(normal, otherNormal) >= kSameNormal && std::abs(glm::dot(across, normal)) <= most &&
         std::abs(glm::dot(across, otherNormal)) <= most;
}

// Images of one frame by pixels.
class Picture {
 public:
  explicit Picture(const PixelReceivers& pixels)
      : p_(pixels), width_(static_cast<int>(pixels.width)), height_(static_cast<int>(pixels.height)) {}

  int width() const { return width_; }
  int height() const { return height_; }
  bool holds(int x, int y) const { return x >= 0 && y >= 0 && x < width_ && y < height_; }
  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  }
  bool seen(std::size_t i) const { return p_.depth[i] > 0.0f; }
  bool same(std::size_t a, std::size_t b) const {
    return isSame(p_.positionWorld[a], p_.plane[a], p_.depth[a], p_.positionWorld[b], p_.plane[b], p_.depth[b]);
  }

  // body(x, y, index) for each pixel.
  template <class Body>
  void forPixels(const ParallelFor& parallelFor, const Body& body) const {
    forChunks(parallelFor, p_.height, 4, [&](std::uint32_t begin, std::uint32_t end) {
      for (auto y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
        for (int x = 0; x < width_; ++x) body(x, y, at(x, y));
      }
    });
  }

 private:
  const PixelReceivers& p_;
  int width_, height_;
};

// The frame about a normal, turned about it by a share of a circle.
glm::mat3 turnedFrame(const glm::vec3& normal, float turn) {
  const glm::mat3 f = frameAbout(normal);
  const float angle = 2.0f * std::numbers::pi_v<float> * turn, c = std::cos(angle), s = std::sin(angle);
  return {c * f[0] + s * f[1], c * f[1] - s * f[0], f[2]};
}

// The mean over the pattern around a pixel, of its own surface.
glm::vec4 gathered(const Picture& picture, std::span<const glm::vec4> traced, std::span<const std::uint8_t> edge, int x,
                   int y) {
  const std::size_t here = picture.at(x, y);
  bool plain = true;
  for (int j = -kReach; j <= kReach && plain; ++j) {
    for (int i = -kReach; i <= kReach && plain; ++i)
      plain = picture.holds(x + i, y + j) && edge[picture.at(x + i, y + j)] == 0;
  }
  glm::vec4 sum(0.0f);
  float count = 0.0f;
  for (int j = -kReach; j <= kReach; ++j) {
    for (int i = -kReach; i <= kReach; ++i) {
      if (!plain && !picture.holds(x + i, y + j)) continue;
      const std::size_t there = picture.at(x + i, y + j);
      if (!plain && !picture.same(here, there)) continue;
      sum += traced[there];
      count += 1.0f;
    }
  }
  return sum / count;
}

// Along one axis: the inner pixels each, the outer ones by pairs.
glm::vec4 blurred(const Picture& picture, std::span<const glm::vec4> from, int x, int y, const glm::ivec2& along) {
  const std::size_t here = picture.at(x, y);
  glm::vec4 sum = from[here];
  float weights = 1.0f;
  const auto add = [&](int i, float weight) {
    const int px = x + i * along.x, py = y + i * along.y;
    if (!picture.holds(px, py)) return;
    const std::size_t there = picture.at(px, py);
    if (!picture.same(here, there)) return;
    sum += weight * from[there];
    weights += weight;
  };
  for (const int side : {-1, 1}) {
    for (int i = 1; i <= kRadius / 2; ++i)
      add(side * i, std::exp(-static_cast<float>(i * i) / (2.0f * kSigma * kSigma)));
    for (int i = kRadius / 2 + 1; i < kRadius; i += 2) {
      const float middle = static_cast<float>(i) + 0.5f, weight = std::exp(-middle * middle / (2.0f * kSigma * kSigma));
      add(side * i, weight);
      add(side * (i + 1), weight);
    }
  }
  return sum / weights;
}

// What a pixel's place had in the frame before, if it was seen: bilinear over the pixels that saw its surface.
struct Before {
  glm::vec4 light{0.0f};
  float frames = 0.0f;  // 0 = nothing
};

Before reprojected(const Picture& picture, const PixelReceivers& pixels, const PixelHistory& h, int x, int y) {
  const std::size_t here = picture.at(x, y);
  Before before;
  if (!picture.seen(here)) return before;
  const glm::vec4 clip = h.clipFromWorld * glm::vec4(pixels.positionWorld[here], 1.0f);
  if (!(clip.w > 0.0f)) return before;
  const auto width = static_cast<float>(pixels.width), height = static_cast<float>(pixels.height);
  const float px = (0.5f + 0.5f * clip.x / clip.w) * width - 0.5f, py = (0.5f - 0.5f * clip.y / clip.w) * height - 0.5f;
  if (!(px > -1.0f && py > -1.0f && px < width && py < height)) return before;
  const int x0 = static_cast<int>(std::floor(px)), y0 = static_cast<int>(std::floor(py));
  const float fx = px - static_cast<float>(x0), fy = py - static_cast<float>(y0);
  float share = 0.0f;
  for (int k = 0; k < 4; ++k) {
    if (!picture.holds(x0 + (k & 1), y0 + (k >> 1))) continue;
    const std::size_t q = picture.at(x0 + (k & 1), y0 + (k >> 1));
    if (!isSame(pixels.positionWorld[here], pixels.plane[here], pixels.depth[here], h.position[q], h.normal[q],
                h.depth[q]))
      continue;
    const float w = ((k & 1) != 0 ? fx : 1.0f - fx) * ((k >> 1) != 0 ? fy : 1.0f - fy);
    before.light += w * h.light[q];
    before.frames += w * h.weight[q];
    share += w;
  }
  if (!(share > 1e-3f)) return {};
  return {before.light / share, before.frames / share};
}

// Light of before, no brighter nor darker than what is around a pixel, and a quarter more.
glm::vec4 limited(const Picture& picture, std::span<const glm::vec4> light, const glm::vec4& before, int x, int y) {
  const std::size_t here = picture.at(x, y);
  glm::vec4 low = light[here], high = light[here];
  for (int j = -kReach; j <= kReach; ++j) {
    for (int i = -kReach; i <= kReach; ++i) {
      if (!picture.holds(x + i, y + j)) continue;
      const std::size_t there = picture.at(x + i, y + j);
      if (!picture.same(here, there)) continue;
      low = glm::min(low, light[there]);
      high = glm::max(high, light[there]);
    }
  }
  return glm::clamp(before, 0.75f * low, 1.25f * high);
}

}  // namespace

Status checkPixelConeOptions(const PixelConeOptions& options) {
  if (options.mostFrames < 1 || options.mostFrames > 1024)
    return pixelConesError(std::to_string(options.mostFrames) + " frames to keep, expected 1 to 1024");
  if (!(options.falloff >= 0.0f && options.falloff <= 1e6f)) return pixelConesError("falloff is outside of 0 to 1e6");
  return done();
}

Status checkPixelFrame(std::uint32_t width, std::uint32_t height, const glm::mat4& clipFromWorld) {
  if (width < 1 || width > 16384 || height < 1 || height > 16384)
    return pixelConesError(std::to_string(width) + " x " + std::to_string(height) +
                           " pixels, expected 1 to 16384 each way");
  for (int c = 0; c < 4; ++c) {
    for (int r = 0; r < 4; ++r) {
      if (!std::isfinite(clipFromWorld[c][r])) return pixelConesError("clipFromWorld has a number that is not finite");
    }
  }
  return done();
}

Status checkPixels(const PixelReceivers& p) {
  if (Status ok = checkPixelFrame(p.width, p.height, p.clipFromWorld); !ok) return ok;
  const std::size_t count = std::size_t{p.width} * p.height;
  for (const std::size_t size : {p.positionWorld.size(), p.plane.size(), p.normal.size(), p.depth.size()}) {
    if (size != count)
      return pixelConesError("an image has " + std::to_string(size) + " pixels, expected " + std::to_string(count));
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (p.depth[i] == 0.0f) continue;
    if (!(p.depth[i] > 0.0f && p.depth[i] <= kMaxCoordinate) || !isWithin(p.positionWorld[i], kMaxCoordinate) ||
        !isWithin(p.plane[i], 2.0f) || !isWithin(p.normal[i], 2.0f))
      return pixelConesError("pixel " + std::to_string(i) +
                             " has a position, normal or depth that is out of range or not finite");
  }
  return done();
}

Result<PixelCones> PixelCones::create(const PixelConeOptions& options) {
  if (Status ok = checkPixelConeOptions(options); !ok) return ok.error();
  return PixelCones(options);
}

void PixelCones::reset() { history_ = {}; }

Status PixelCones::update(const ConeTracer& cones, const PixelReceivers& pixels, const ParallelFor& parallelFor) {
  if (Status ok = checkPixels(pixels); !ok) return ok;
  const Picture picture(pixels);
  const std::size_t count = std::size_t{pixels.width} * pixels.height;
  try {
    std::vector<glm::vec4> light(count, glm::vec4(0.0f)), other(count);
    std::vector<float> weight(count, 1.0f);
    std::vector<std::uint8_t> edge(count, 0);

    // 1. A cone a pixel, or all
    Stopwatch watch;
    const float turn = options_.interleaved ? turnOfFrame(frame_) : 0.0f;
    picture.forPixels(parallelFor, [&](int x, int y, std::size_t i) {
      if (!picture.seen(i)) return;
      const glm::mat3 frame = turnedFrame(pixels.normal[i], turn);
      const auto one = [&](std::uint32_t which) {
        const Gathered found =
            cones.hemisphereCone(which, pixels.positionWorld[i], pixels.plane[i], frame, options_.falloff);
        return glm::vec4(found.radiance, found.occlusion);
      };
      if (options_.interleaved) {
        light[i] = one(coneOfPixel(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y)));
      } else {
        for (std::uint32_t k = 0; k < kHemisphereCones; ++k) light[i] += one(k) / static_cast<float>(kHemisphereCones);
      }
    });
    coneMs_ = watch.lap();

    // 2. Where surfaces end
    picture.forPixels(parallelFor, [&](int x, int y, std::size_t i) {
      for (const glm::ivec2& d : {glm::ivec2(1, 0), glm::ivec2(0, 1), glm::ivec2(1, 1)}) {
        if (picture.holds(x + d.x, y + d.y) && !picture.same(i, picture.at(x + d.x, y + d.y))) edge[i] = 1;
      }
    });
    edgeMs_ = watch.lap();

    // 3. The pattern's cones together, and a blur
    if (options_.gather) {
      picture.forPixels(parallelFor, [&](int x, int y, std::size_t i) {
        other[i] = picture.seen(i) ? gathered(picture, light, edge, x, y) : glm::vec4(0.0f);
      });
      light.swap(other);
    }
    gatherMs_ = watch.lap();
    if (options_.blur) {
      for (const glm::ivec2& along : {glm::ivec2(1, 0), glm::ivec2(0, 1)}) {
        picture.forPixels(parallelFor, [&](int x, int y, std::size_t i) {
          other[i] = picture.seen(i) ? blurred(picture, light, x, y, along) : glm::vec4(0.0f);
        });
        light.swap(other);
      }
    }
    blurMs_ = watch.lap();

    // 4. What was found before, where the same surface was seen
    if (options_.keep && history_.width == pixels.width && history_.height == pixels.height) {
      picture.forPixels(parallelFor, [&](int x, int y, std::size_t i) {
        const Before before = reprojected(picture, pixels, history_, x, y);
        other[i] = light[i];
        if (!(before.frames > 0.0f)) return;
        other[i] = (before.frames * limited(picture, light, before.light, x, y) + light[i]) / (before.frames + 1.0f);
        weight[i] = std::min(before.frames + 1.0f, static_cast<float>(options_.mostFrames));
      });
      light.swap(other);
    }
    PixelHistory next;
    if (options_.keep) {
      next = {pixels.width,
              pixels.height,
              light,
              {pixels.positionWorld.begin(), pixels.positionWorld.end()},
              {pixels.plane.begin(), pixels.plane.end()},
              {pixels.depth.begin(), pixels.depth.end()},
              weight,
              pixels.clipFromWorld};
    }
    keepMs_ = watch.lap();
    history_ = std::move(next);
    light_ = std::move(light);
    weight_ = std::move(weight);
    edge_ = std::move(edge);
    ++frame_;
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::memory, "cones of pixels: memory ran out; a smaller picture takes less"};
  }
  return done();
}

std::vector<PassTime> PixelCones::passTimes() const {
  return {{"cones", coneMs_}, {"edges", edgeMs_}, {"gather", gatherMs_}, {"blur", blurMs_}, {"keep", keepMs_}};
}

}  // namespace relume
