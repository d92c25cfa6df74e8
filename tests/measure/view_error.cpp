// SPDX-License-Identifier: MIT
// Where the error of a view lies: the squared difference from a path-traced reference by class of pixel, beside that of
// light gathered at the pixel itself from the bake's surfels, which has the senders' error alone, and from the level
// with exact direct light, which has only that of the bounces. Prints the tables of docs/notes/view_error.md.
//   bench_view_error LEVEL.glb BAKE.relume CAMERA__LIGHTS.exr [RAYS [PICTURE.png]]
// The picture: reference | bake | error (red: too bright, blue: too dark).
#include "bake/base/parallel.h"
#include "bake/base/point_grid.h"
#include "bake/reference/path_tracer.h"
#include "formats/pack.h"
#include "relume/bake_file.h"
#include "tests/accuracy/compare_images.h"
#include "tests/measure/traced_light.h"
#include "tools/render/render_cpu.h"
#include "tools/render/seen_surface.h"

#include <glm/gtc/constants.hpp>
#include <glm/trigonometric.hpp>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <map>
#include <string>

namespace relume {
namespace {

using test::cosineDirection, test::lightsNamed, test::TracedLevel;

// The surfel that stands for a point of the level: the nearest that faces the same way.
class NearestSurfel {
 public:
  NearestSurfel(const Surfels& surfels, Context& context)
      : surfels_(surfels), grid_(surfels.positionWorld, 2.0f * std::sqrt(surfels.areaEach), context) {}

  std::uint32_t at(const glm::vec3& position, const glm::vec3& normal) const {
    std::uint32_t best = kNone;
    float least = std::numeric_limits<float>::infinity();
    grid_.forEachRun(position, 1, [&](std::uint32_t begin, std::uint32_t end) {
      for (std::uint32_t i = begin; i < end; ++i) {
        const std::uint32_t s = grid_.order()[i];
        if (glm::dot(surfels_.normal[s], normal) < 0.3f) continue;
        const glm::vec3 d = surfels_.positionWorld[s] - position;
        const float distance = glm::dot(d, d);
        if (distance < least) least = distance, best = s;
      }
    });
    return best;
  }

 private:
  const Surfels& surfels_;
  PointGrid grid_;
};

// Means of the caches that a pixel reads, by their bilinear weights.
struct Reading {
  bool map = false;
  float distance = 0.0f;  // [m] from the pixel's surface
  float cosine = 1.0f;    // of the normals
};

struct Pixel {
  SeenSurface seen;
  Reading reading;
  std::string node;
  bool masked = false;
  int edgeDistance = 9;                                // [pixels] to the next pixel that does not count
  glm::vec3 truth{0.0f}, variance{0.0f}, found{0.0f};  // irradiance / pi
  std::array<glm::vec3, 2> bySurfels{}, byDirect{};    // by each half of the rays
  std::array<bool, 3> counts{};
};

Reading readingOf(const Bake& bake, const std::optional<glm::vec2>& uv, const SeenSurface& seen) {
  Reading reading;
  if (!uv) return reading;
  const Lightmap& map = bake.caches.lightmap;
  const glm::vec2 at = *uv * glm::vec2(map.width, map.height) - 0.5f, low = glm::floor(at), f = at - low;
  float sum = 0.0f;
  glm::vec2 mean(0.0f);
  for (int k = 0; k < 4; ++k) {
    const int x = static_cast<int>(low.x) + k % 2, y = static_cast<int>(low.y) + k / 2;
    const float w = (k % 2 ? f.x : 1.0f - f.x) * (k / 2 ? f.y : 1.0f - f.y);
    if (w < 1e-3f || x < 0 || y < 0 || x >= static_cast<int>(map.width) || y >= static_cast<int>(map.height)) continue;
    const std::uint32_t cache = map.cache[static_cast<std::size_t>(y) * map.width + static_cast<std::size_t>(x)];
    if (cache == kNoCache) continue;
    sum += w;
    mean += w * glm::vec2(glm::distance(bake.caches.positionWorld[cache], seen.positionWorld),
                          glm::dot(bake.caches.normal[cache], seen.normal));
  }
  return sum > 0.0f ? Reading{true, mean.x / sum, mean.y / sum} : reading;
}

struct View {
  const Scene& scene;
  const RayTracer& tracer;
  const Bake& bake;
  const Relighter& relighter;
  std::vector<SceneLight> lights;
  std::vector<glm::vec3> radiosity;  // [Size surfels] [W/m²]
};

// Light at the pixel itself: from surfels, and with direct light where each ray ends.
void gatherAt(const View& view, const NearestSurfel& nearest, int rays, std::size_t index, Pixel& pixel) {
  RandomStream random(17, 0x76696577, index);
  const glm::vec3 origin =
      pixel.seen.positionWorld + pixel.seen.geometricNormal * view.tracer.epsilonAt(pixel.seen.positionWorld);
  const int side = std::max(1, static_cast<int>(std::sqrt(0.5f * static_cast<float>(rays)))), half = side * side;
  for (int k = 0; k < 2 * half; ++k) {
    const glm::vec2 u = (glm::vec2(k % side, k % half / side) + random.uniform2()) / static_cast<float>(side);
    Ray ray;
    ray.origin = origin;
    ray.direction = cosineDirection(pixel.seen.normal, u);
    const Hit hit = view.tracer.trace(ray);
    if (!hit) continue;
    const SeenSurface at = seenAt(view.scene, ray, hit);
    const glm::vec3 indirect = linkIrradiance(view.scene, view.bake, view.relighter, at);
    const glm::vec3 direct = directIrradiance(view.tracer, view.lights, at.positionWorld, at.normal);
    const auto which = static_cast<std::size_t>(k / half);
    const float weight = glm::one_over_pi<float>() / static_cast<float>(half);
    pixel.byDirect[which] += weight * albedoAt(view.scene, at.point) * (direct + indirect);
    const std::uint32_t s = nearest.at(at.positionWorld, at.geometricNormal);
    if (s != kNone) pixel.bySurfels[which] += weight * view.radiosity[s];
  }
}

// Squared difference from the truth, less the variances of both.
double square(const Pixel& p, const glm::vec3& found, const glm::vec3& variance = glm::vec3(0.0f)) {
  double sum = 0.0;
  for (int c = 0; c < 3; ++c) {
    if (!p.counts[static_cast<std::size_t>(c)]) continue;
    const float off = found[c] - p.truth[c];
    sum += static_cast<double>(off * off - p.variance[c] - variance[c]);
  }
  return sum;
}

double square(const Pixel& p, const std::array<glm::vec3, 2>& halves) {
  const glm::vec3 error = 0.5f * (halves[0] - halves[1]);
  return square(p, 0.5f * (halves[0] + halves[1]), error * error);
}

double sumOf(const Pixel& p, const glm::vec3& v) {
  double sum = 0.0;
  for (int c = 0; c < 3; ++c) sum += p.counts[static_cast<std::size_t>(c)] ? static_cast<double>(v[c]) : 0.0;
  return sum;
}

struct Sums {
  double pixels = 0, channels = 0, square = 0, bySurfels = 0, byDirect = 0, found = 0, truth = 0;
  void add(const Pixel& p) {
    pixels += 1;
    for (const bool c : p.counts) channels += c;
    square += relume::square(p, p.found);
    bySurfels += relume::square(p, p.bySurfels);
    byDirect += relume::square(p, p.byDirect);
    found += sumOf(p, p.found);
    truth += sumOf(p, p.truth);
  }
};

double percent(double meanSquare, double mean) { return 100.0 * std::sqrt(std::max(0.0, meanSquare)) / mean; }

void printTable(const char* title, const std::vector<const Pixel*>& pixels,
                const std::function<std::string(const Pixel&)>& classOf) {
  constexpr std::size_t kMaxRows = 12;
  std::map<std::string, Sums> classes;
  Sums all;
  for (const Pixel* p : pixels) classes[classOf(*p)].add(*p), all.add(*p);
  const double mean = all.truth / all.channels;
  std::vector<std::pair<std::string, Sums>> rows(classes.begin(), classes.end());
  if (rows.size() > kMaxRows) {
    std::sort(rows.begin(), rows.end(), [](const auto& a, const auto& b) { return a.second.square > b.second.square; });
    rows.resize(kMaxRows);
  }
  rows.emplace_back("all", all);
  std::printf(
      "\n| %s | pixels %% | of the squared error %% | error %% of the mean | by surfels | by direct light | energy |\n"
      "|---|---:|---:|---:|---:|---:|---:|\n",
      title);
  for (const auto& [name, s] : rows) {
    std::printf("| %s | %.1f | %.1f | %.1f | %.1f | %.1f | %.3f |\n", name.c_str(), 100.0 * s.pixels / all.pixels,
                100.0 * s.square / all.square, percent(s.square / s.channels, mean),
                percent(s.bySurfels / s.channels, mean), percent(s.byDirect / s.channels, mean), s.found / s.truth);
  }
}

std::string range(double value, std::initializer_list<double> bounds, const char* unit) {
  char text[64];
  double low = -1.0;
  int index = 0;
  for (const double bound : bounds) {
    if (value < bound) {
      std::snprintf(text, sizeof text, "%c %s%g%s", 'a' + index, "below ", bound, unit);
      return text;
    }
    low = bound;
    ++index;
  }
  std::snprintf(text, sizeof text, "%c from %g%s on", 'a' + index, low, unit);
  return text;
}

void printTables(const char* title, const std::vector<const Pixel*>& pixels, double mean) {
  Sums all;
  double rms = 0.0;
  for (const Pixel* p : pixels) {
    all.add(*p);
    rms += sumOf(*p, p->truth * p->truth);
  }
  std::printf("\n## %s\n\nRoot mean square of the truth: %.2f means.\n", title, std::sqrt(rms / all.channels) / mean);
  printTable("reads", pixels, [](const Pixel& p) {
    return std::string(p.reading.map ? "map" : "grid") + (p.seen.back ? ", back side" : "");
  });
  printTable("truth, means", pixels, [&](const Pixel& p) {
    return range(static_cast<double>(p.truth.x + p.truth.y + p.truth.z) / 3.0 / mean, {0.1, 0.3, 1, 3, 10}, "");
  });
  printTable("shading against geometric normal", pixels, [](const Pixel& p) {
    return range(
        glm::degrees(std::acos(std::min(1.0, static_cast<double>(glm::dot(p.seen.normal, p.seen.geometricNormal))))),
        {3, 15, 30}, " deg");
  });
  printTable("to the caches read", pixels, [](const Pixel& p) {
    return p.reading.map ? range(static_cast<double>(p.reading.distance), {0.25, 0.5, 0.75, 1.0, 1.5}, " m") : "grid";
  });
  printTable("caches' normals", pixels, [](const Pixel& p) {
    return p.reading.map ? range(glm::degrees(std::acos(std::clamp(static_cast<double>(p.reading.cosine), -1.0, 1.0))),
                                 {5, 20, 40}, " deg")
                         : "grid";
  });
  printTable("to an edge", pixels, [](const Pixel& p) { return range(p.edgeDistance, {2, 3, 5, 9}, " pixels"); });
  printTable("alpha", pixels, [](const Pixel& p) { return p.masked ? std::string("mask") : "opaque"; });
  printTable("node", pixels, [](const Pixel& p) { return p.node; });
}

int distanceToEdge(const std::vector<std::uint8_t>& ok, std::uint32_t width, std::uint32_t height, std::uint32_t x,
                   std::uint32_t y) {
  for (int r = 1; r < 9; ++r) {
    for (int dy = -r; dy <= r; ++dy) {
      for (int dx = -r; dx <= r; ++dx) {
        const int px = static_cast<int>(x) + dx, py = static_cast<int>(y) + dy;
        if (px < 0 || py < 0 || px >= static_cast<int>(width) || py >= static_cast<int>(height)) continue;
        if (!ok[3 * (static_cast<std::size_t>(py) * width + static_cast<std::size_t>(px))]) return r;
      }
    }
  }
  return 9;
}

int fail(const std::string& message) { return std::fprintf(stderr, "%s\n", message.c_str()), 1; }

int measure(const std::string& level, const std::string& bakePath, const std::filesystem::path& referencePath, int rays,
            const std::string& picture) {
  Context context;
  auto scene = importGltf(level, context);
  if (!scene) return fail(scene.error().message);
  auto tracer = RayTracer::create(*scene, "avx2", context);
  if (!tracer) return fail(tracer.error().message);
  auto bake = readBake(bakePath);
  if (!bake) return fail(bake.error().message);
  const auto reference = readExr(referencePath);
  if (!reference) return fail(reference.error().message);
  const std::string stem = referencePath.stem().string(), camera = stem.substr(0, stem.find("__"));
  std::string lights = stem.substr(stem.find("__") + 2);
  std::replace(lights.begin(), lights.end(), '+', ',');
  RenderRequest request;
  request.bake = &*bake;
  request.lights = lightsNamed(*scene, lights);
  request.width = reference->width;
  request.height = reference->height;
  const auto seenBy =
      std::find_if(scene->cameras.begin(), scene->cameras.end(), [&](const Camera& c) { return c.name == camera; });
  if (seenBy == scene->cameras.end() || request.lights.empty())
    return fail(stem + ": no such camera, or no such lights");
  request.camera = *seenBy;
  const auto frame = renderCpu(*tracer, request, context);
  if (!frame) return fail(frame.error().message);

  // Light by surfels
  const TracedLevel traced{*scene, *tracer, request.lights, false};
  const std::vector<glm::vec3> direct = test::shadowedLight(traced, bake->surfels);
  LightSetup setup;
  setup.surfelIrradiance = direct;
  setup.emissionScale = glm::vec3(0.0f);
  auto relighter = Relighter::create(*bake, {});
  if (!relighter) return fail(relighter.error().message);
  if (const auto frames = relightUntilConverged(*relighter, setup); !frames) return fail(frames.error().message);
  View view{*scene, *tracer, *bake, *relighter, request.lights, {}};
  const Surfels& surfels = bake->surfels;
  for (std::uint32_t s = 0; s < surfels.count(); ++s) {
    const std::uint32_t at = surfels.receiver[s];
    const glm::vec3 indirect =
        at == kGridReceiver
            ? relighter->irradianceInGrid(surfels.positionWorld[s], surfels.normal[s])
            : relighter->irradianceOnLightmap(unpackUnorm16x2(at), surfels.normal[s], surfels.normal[s]);
    view.radiosity.push_back(surfels.albedo[s] * (direct[s] + indirect));
  }
  const NearestSurfel nearest(surfels, context);

  // Pixels
  const auto ok = validChannels(*reference, {});
  const auto truth = reference->layer("DiffInd"), noise = reference->layer("DiffIndErr");
  const std::vector<glm::vec3> found = composeAov(*frame, Aov::indirect);
  const CameraRays cameraRays(request.camera, request.width, request.height);
  std::vector<Pixel> pixels(found.size());
  parallelChunks(context, "", pixels.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Pixel& p = pixels[i];
      const auto x = static_cast<std::uint32_t>(i % request.width), y = static_cast<std::uint32_t>(i / request.width);
      for (std::size_t c = 0; c < 3; ++c) p.counts[c] = ok[3 * i + c] != 0;
      if (!p.counts[0] && !p.counts[1] && !p.counts[2]) continue;
      Ray ray;
      cameraRays.at(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f, ray.origin, ray.direction);
      const Hit hit = tracer->trace(ray);
      if (!hit) {
        p.counts = {};
        continue;
      }
      p.seen = seenAt(*scene, ray, hit);
      p.reading = readingOf(*bake, lightmapPoint(*scene, *bake, p.seen), p.seen);
      p.node = scene->instances[hit.instance].node;
      p.masked = scene->material(scene->instances[hit.instance]).alphaMode == AlphaMode::mask;
      p.edgeDistance = distanceToEdge(ok, request.width, request.height, x, y);
      p.truth = truth[i];
      p.variance = noise.empty() ? glm::vec3(0.0f) : noise[i] * noise[i];
      p.found = found[i];
      gatherAt(view, nearest, rays, i, p);
    }
  });
  std::vector<const Pixel*> counted;
  double sum = 0.0, channels = 0.0;
  for (const Pixel& p : pixels) {
    if (!p.counts[0] && !p.counts[1] && !p.counts[2]) continue;
    counted.push_back(&p);
    sum += sumOf(p, p.truth);
    for (const bool c : p.counts) channels += c;
  }
  const double mean = sum / channels;
  std::stable_sort(counted.begin(), counted.end(),
                   [](const Pixel* a, const Pixel* b) { return square(*a, a->found) < square(*b, b->found); });
  printTables("All pixels", counted, mean);
  counted.resize(counted.size() * 99 / 100);
  printTables("Without the worst 1 %", counted, mean);
  if (picture.empty()) return 0;

  // Reference | bake | error
  const std::uint32_t width = 3 * request.width;
  std::vector<glm::vec3> image(pixels.size() * 3, glm::vec3(0.0f));
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const Pixel& p = pixels[i];
    const std::size_t at = i / request.width * width + i % request.width;
    image[at] = 0.3f * truth[i] / static_cast<float>(mean);
    image[at + request.width] = 0.3f * found[i] / static_cast<float>(mean);
    const double off = (sumOf(p, p.found) - sumOf(p, p.truth)) / 3.0 / mean;
    image[at + 2 * request.width] = glm::vec3(off > 0 ? off : 0.0, 0.0, off < 0 ? -off : 0.0);
  }
  const Status wrote = writePng(picture, width, request.height, image);
  return wrote ? 0 : fail(wrote.error().message);
}

}  // namespace
}  // namespace relume

int main(int argc, char** argv) {
  if (argc < 4)
    return std::fprintf(stderr,
                        "usage: bench_view_error LEVEL.glb BAKE.relume CAMERA__LIGHTS.exr [RAYS [PICTURE.png]]\n"),
           1;
  return relume::measure(argv[1], argv[2], argv[3], argc > 4 ? std::atoi(argv[4]) : 256, argc > 5 ? argv[5] : "");
}
