// SPDX-License-Identifier: MIT
// How far views of a level are from a path-traced reference when their indirect light is read from light maps of the
// same texels: Relume's caches, Relume's plain map, and maps that Cycles baked. Prints rows of
// docs/notes/beside_blender.md.
//   bench_lightmap_error LEVEL.glb BAKE.relume CAMERA LIGHTS REFERENCE.exr [MAP.raw...]
// LIGHTS: names by commas. The maps are what tests/measure/cycles_bake.py writes: RGBA floats, rows from the bottom,
// irradiance / pi, alpha 0 where there is none. Pixels count whose surface every one of them has light for.
#include "tests/accuracy/compare_images.h"
#include "tests/measure/open_view.h"
#include "tools/render/relight_by_rays.h"
#include "tools/render/seen_surface.h"

#include <glm/common.hpp>
#include <glm/gtc/packing.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <numbers>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

namespace relume {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr std::uint32_t kSide = 2;  // sub-pixels along a pixel's side

// Irradiance / pi of each texel, and 1 where there is light; rows from the top.
struct Map {
  std::string name;
  glm::uvec2 size{0};
  std::vector<glm::vec4> texel;

  // Bilinear, by the texels that have light; w = 0 where none has.
  glm::vec4 at(const glm::vec2& uv) const {
    const glm::vec2 p = uv * glm::vec2(size) - 0.5f, f = p - glm::floor(p);
    glm::vec4 sum(0.0f);
    for (int k = 0; k < 4; ++k) {
      const glm::ivec2 at =
          glm::clamp(glm::ivec2(glm::floor(p)) + glm::ivec2(k & 1, k >> 1), glm::ivec2(0), glm::ivec2(size) - 1);
      const glm::vec4& t = texel[static_cast<std::size_t>(at.y) * size.x + static_cast<std::size_t>(at.x)];
      const float w = (k & 1 ? f.x : 1.0f - f.x) * (k >> 1 ? f.y : 1.0f - f.y) * t.w;
      if (w > 0.0f && std::isfinite(t.x + t.y + t.z)) sum += w * glm::vec4(glm::vec3(t), 1.0f);
    }
    return sum.w > 0.01f ? sum / sum.w : glm::vec4(0.0f);
  }
};

int fail(const std::string& message) { return std::fprintf(stderr, "%s\n", message.c_str()), 1; }

std::optional<Map> readRaw(const std::string& path, const glm::uvec2& size) {
  std::ifstream file(path, std::ios::binary);
  std::vector<glm::vec4> rows(std::size_t{size.x} * size.y);
  file.read(reinterpret_cast<char*>(rows.data()), static_cast<std::streamsize>(rows.size() * sizeof(glm::vec4)));
  if (!file || file.peek() != std::ifstream::traits_type::eof()) return std::nullopt;
  Map map{path, size, {}};
  for (std::uint32_t y = size.y; y-- > 0;) {
    const auto row = rows.begin() + std::ptrdiff_t{y} * size.x;
    map.texel.insert(map.texel.end(), row, row + size.x);
  }
  return map;
}

Result<Map> plainMap(const Relighter& relighter) {
  Map map{"Relume, plain map", relighter.lightmapSize(), {}};
  std::vector<std::uint16_t> halves(std::size_t{4} * map.size.x * map.size.y);
  if (Status read = relighter.irradianceMap(halves); !read) return read.error();
  for (std::size_t i = 0; i < halves.size(); i += 4) {
    const auto half = [&](std::size_t c) { return glm::unpackHalf1x16(halves[i + c]); };
    map.texel.emplace_back(glm::vec3(half(0), half(1), half(2)) / kPi, half(3));
  }
  return map;
}

// One image of what the caches say, then one for each map; pixels for which one of them has no light, or that show a
// back side or the grid's light, are taken out of `reference`.
std::vector<std::vector<glm::vec3>> readMaps(const test::OpenedView& view, const Relighter& relighter,
                                             const std::vector<Map>& maps, ChannelImage& reference) {
  const std::uint32_t width = reference.width, height = reference.height;
  const CameraRays rays(view.camera, width, height);
  std::vector<std::vector<glm::vec3>> images(1 + maps.size(), std::vector<glm::vec3>(std::size_t{width} * height));
  for (std::uint32_t pixel = 0; pixel < width * height; ++pixel) {
    bool counts = true;
    for (std::uint32_t k = 0; k < kSide * kSide && counts; ++k) {
      const glm::vec2 at = (glm::vec2(k % kSide, k / kSide) + 0.5f) / static_cast<float>(kSide);
      Ray ray;
      rays.at(static_cast<float>(pixel % width) + at.x, static_cast<float>(pixel / width) + at.y, ray.origin,
              ray.direction);
      const Hit hit = view.tracer.trace(ray);
      counts = static_cast<bool>(hit);
      if (!counts) break;
      const SeenSurface seen = seenAt(*view.scene, ray, hit);
      const auto uv = lightmapPoint(*view.scene, view.bake, seen);
      counts = uv && !seen.back;
      if (!counts) break;
      constexpr float kShare = 1.0f / (kSide * kSide);
      images[0][pixel] += kShare / kPi * linkIrradiance(*view.scene, view.bake, relighter, seen);
      for (std::size_t m = 0; m < maps.size(); ++m) {
        const glm::vec4 light = maps[m].at(*uv);
        counts = counts && light.w > 0.0f;
        images[m + 1][pixel] += kShare * glm::vec3(light);
      }
    }
    for (const char* channel : {"DiffCol.R", "DiffCol.G", "DiffCol.B"}) {
      if (!counts) reference.channels[channel][pixel] = 0.0f;
    }
  }
  return images;
}

int measure(const std::string& level, const std::string& bakePath, const std::string& camera, const std::string& lights,
            const std::string& referencePath, const std::vector<std::string>& files) {
  Context context;
  const auto view = test::openView(level, bakePath, camera, context);
  if (!view) return fail(view.error().message);
  auto reference = readExr(referencePath);
  if (!reference) return fail(reference.error().message);

  RenderRequest request;
  request.bake = &view->bake;
  std::istringstream names(lights);
  for (std::string name; std::getline(names, name, ',');) {
    const auto& all = view->scene->lights;
    const auto found = std::find_if(all.begin(), all.end(), [&](const SceneLight& l) { return l.name == name; });
    if (found == all.end()) return fail("no light " + name);
    request.lights.push_back(*found);
  }
  const auto relit = relightByRays(view->tracer, request, context);
  if (!relit) return fail(relit.error().message);
  auto plain = plainMap(*relit->all);
  if (!plain) return fail(plain.error().message);
  std::vector<Map> maps{std::move(*plain)};
  for (const std::string& path : files) {
    auto map = readRaw(path, maps[0].size);
    if (!map) return fail(path + ": RGBA floats of the light map's size expected");
    maps.push_back(std::move(*map));
  }

  const auto images = readMaps(*view, *relit->all, maps, *reference);
  std::printf("| %s, %s | RMSE %% | t1 %% | energy |\n|---|---:|---:|---:|\n", camera.c_str(), lights.c_str());
  double share = 0.0, noise = 0.0;
  for (std::size_t i = 0; i < images.size(); ++i) {
    ChannelImage candidate{reference->width, reference->height, {}};
    candidate.setLayer("", images[i]);
    const auto d = compareImages(*reference, candidate, CompareOptions{});
    if (!d) return fail(d.error().message);
    std::printf("| %s | %.1f | %.1f | %.3f |\n", i == 0 ? "Relume" : maps[i - 1].name.c_str(), 100 * d->rmseClean,
                100 * d->rmseTrimmed, d->energy);
    share = d->validShare;
    noise = d->noise;
  }
  std::printf("%.0f %% of the pixels; noise of the reference %.1f %%\n", 100 * share, 100 * noise);
  return 0;
}

}  // namespace
}  // namespace relume

int main(int argc, char** argv) {
  if (argc < 6) {
    return std::fprintf(stderr,
                        "usage: bench_lightmap_error LEVEL.glb BAKE.relume CAMERA LIGHTS REFERENCE.exr [MAP.raw...]\n"),
           1;
  }
  return relume::measure(argv[1], argv[2], argv[3], argv[4], argv[5], {argv + 6, argv + argc});
}
