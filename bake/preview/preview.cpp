// SPDX-License-Identifier: MIT
// See preview.h. RCS Algorithm 2 as numbered steps. The paper's step 5 draws the splats anew with all records and adds
// direct light; so does this. Its test for "none yet" prints SPLATBUFF.w < a.
//
// Erratum: with Eq. (3) it is w < 1/a; both mean that there is none, for any contribution is at least 1/a.
#include "bake/preview/preview.h"

#include "bake/base/parallel.h"
#include "bake/preview/adapt_reach.h"
#include "bake/preview/mirror_surface.h"
#include "bake/preview/radiance_records.h"
#include "bake/preview/receivers.h"
#include "bake/preview/record_tiles.h"
#include "bake/preview/screen_box.h"
#include "bake/preview/shade.h"
#include "formats/decimal.h"

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <string>

namespace relume {
namespace {

using Clock = std::chrono::steady_clock;

constexpr float kLeastAccuracy = 0.02f;
constexpr std::uint32_t kMostRays = 65536;
constexpr float kCoarsest = 1.0f;      // accuracy of the first picture under a time limit
constexpr double kDiffuseShare = 0.5;  // of the time limit, where mirrors need records as well
constexpr float kFarthest = 4.0f;      // times the accuracy up to which records reach out for pixels that have none
constexpr float kFiner = 2.0f / 3.0f;  // times the accuracy where few records do
constexpr float kMoreRays = 16.0f / 9.0f, kSimplest = 2.0f;  // times the rays there, and twice as many for half of few
constexpr float kGrowth = 1.41421356f;

double secondsSince(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

Status checkPreviewOptions(const PreviewOptions& o) {
  const auto outside = [](const char* name, const std::string& range, double value) {
    return Error{ErrorCode::usage,
                 std::string("preview: ") + name + " must be " + range + ", found " + decimalGeneral(value, 6)};
  };
  const auto check = [&](const char* name, double value, double min, double max, const char* range) -> Status {
    if (value >= min && value <= max) return done();
    return outside(name, range, value);
  };
  for (const Status& ok :
       {check("width", o.width, 1, 16384, "1..16384"), check("height", o.height, 1, 16384, "1..16384"),
        check("samples", o.samples, 1, 16, "1..16"),
        check("accuracy", o.accuracy, kLeastAccuracy - 1e-7f, 2, "0.02..2"),
        check("min reach", o.minPixels, 0, 64, "0..64 pixels"),
        check("contrast", o.contrast, 0.000999, 10, "0.001..10"), check("rounds", o.rounds, 0, 16, "0..16"),
        check("rays", o.rays, 16, kMostRays, "16..65536"), check("plane side", o.planeSide, 2, 256, "2..256"),
        check("field of view of the plane", o.planeFovDeg, 10, 175, "10..175 degrees"),
        check("records", o.maxRecords, 1, 1e7, "1..10000000"), check("emitter rays", o.emitterRays, 1, 1024, "1..1024"),
        check("time limit", o.timeLimitSeconds, 0, 1e9, "at least 0 seconds"),
        check("order of radiance records", o.glossyOrder, 0, kMaxHshOrder, "1..10, or 0 for what is needed")}) {
    if (!ok) return ok;
  }
  return done();
}

RecordGatherer::Options gatherOptions(const PreviewOptions& o) {
  return {o.hemisphere, o.rays, o.planeSide, glm::radians(o.planeFovDeg), o.seed, true, o.reach};
}

// The accuracies to reach one after the other: under a time limit, from coarse to what is asked for.
std::vector<float> accuraciesOf(const PreviewOptions& options) {
  std::vector<float> list;
  for (float a = kCoarsest; options.timeLimitSeconds > 0.0 && a > options.accuracy; a *= 0.5f) list.push_back(a);
  list.push_back(options.accuracy);
  return list;
}

// When `share` of the time for records is over; nothing without a limit.
Deadline deadlineOf(const PreviewOptions& options, Clock::time_point begin, double share) {
  if (options.timeLimitSeconds == 0.0) return std::nullopt;
  const std::chrono::duration<double> seconds(share * options.timeLimitSeconds);
  return begin + std::chrono::duration_cast<Clock::duration>(seconds);
}

// What takes the time that a picture of few records leaves: more of them, of more rays, the more the fewer they were.
PreviewOptions finerThan(const PreviewOptions& options, std::size_t records) {
  PreviewOptions finer = options;
  finer.fewRecords = 0;
  finer.accuracy = std::max(kLeastAccuracy, kFiner * options.accuracy);
  const float simple = static_cast<float>(options.fewRecords) / static_cast<float>(std::max<std::size_t>(1, records));
  finer.rays = std::min(kMostRays, static_cast<std::uint32_t>(static_cast<float>(options.rays) * kMoreRays *
                                                              std::clamp(simple, 1.0f, kSimplest)));
  return finer;
}

// Place records, those of the first accuracy however late it is; returns how they are read, or nothing where the
// picture is simple.
std::optional<Interpolation> place(const RecordGatherer& gatherer, const CameraRays& camera,
                                   std::span<const PixelReceiver> receivers, const DrawHemispheres* draw,
                                   const RecordKeeper* keeper, const PreviewOptions& options, const Deadline& deadline,
                                   std::vector<Record>& cache, PreviewFrame& frame, Context& context) {
  const Clock::time_point begin = Clock::now();
  PlacementOptions placement;
  placement.order = options.order;
  placement.maxRecords = options.maxRecords;
  placement.draw = draw;
  placement.keeper = keeper;
  Interpolation reached{options.weight, 0.0f, options.gradients};
  reached.minPixels = options.minPixels;
  reached.reach = options.reach;
  for (const float accuracy : accuraciesOf(options)) {
    placement.interpolation = reached;
    placement.interpolation.accuracy = accuracy;
    Placement outcome = placeRecords(gatherer, camera, receivers, placement, cache, context);
    const bool first = reached.accuracy == 0.0f;
    if (first) frame.firstSeconds = secondsSince(begin);
    placement.deadline = deadline;
    if (outcome == Placement::complete || first) reached = placement.interpolation;
    if (!deadline && cache.size() < options.fewRecords && outcome == Placement::complete) return std::nullopt;
    // Contradictions are settled at the accuracy that is asked for: on the way there others are in a hurry.
    const int rounds = accuracy == options.accuracy ? options.rounds : 0;
    for (int round = 0; round < rounds && outcome == Placement::complete; ++round) {
      const RecordTiles tiles(camera, cache, placement.interpolation);
      if (limitReaches(tiles, receivers, options.width, options.contrast, cache, context) == 0) break;
      outcome = placeRecords(gatherer, camera, receivers, placement, cache, context);
    }
    if (outcome == Placement::full)
      context.message(Severity::warning, "preview: " + std::to_string(options.maxRecords) +
                                             " records did not reach every pixel; raise --max-records or --accuracy");
    if (outcome != Placement::complete) break;
  }
  frame.accuracy = reached.accuracy;
  frame.recordSeconds = secondsSince(begin);
  return reached;
}

bool isMissing(const PixelReceiver& receiver, const Splat& splat) {
  return receiver.normal != glm::vec3(0.0f) && !(splat.weight > 0.0f);
}

std::uint32_t countMissing(std::span<const PixelReceiver> receivers, std::span<const Splat> centers) {
  std::uint32_t count = 0;
  for (std::size_t i = 0; i < receivers.size(); ++i) count += isMissing(receivers[i], centers[i]) ? 1 : 0;
  return count;
}

// Light for pixels that no record reaches by any stretch: that of the pixel most alike among the nearest lit ones in
// their row and column. Two sweeps there and two back.
void fillMissing(std::span<const PixelReceiver> receivers, std::uint32_t width, std::span<Splat> centers) {
  constexpr std::size_t kNothing = static_cast<std::size_t>(-1);
  const auto unlike = [&](std::size_t a, std::size_t b) {
    return 1.0f - glm::dot(receivers[a].normal, receivers[b].normal) +
           glm::distance(receivers[a].positionWorld, receivers[b].positionWorld) / (64.0f * receivers[a].footprint);
  };
  const std::size_t count = receivers.size();
  std::vector<std::size_t> above(width);
  for (int sweep = 0; sweep < 4; ++sweep) {
    std::fill(above.begin(), above.end(), kNothing);
    std::size_t before = kNothing;
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t i = sweep % 2 == 0 ? k : count - 1 - k;
      if (k % width == 0) before = kNothing;
      std::size_t& column = above[i % width];
      if (isMissing(receivers[i], centers[i])) {
        std::size_t from = before != kNothing ? before : column;
        if (before != kNothing && column != kNothing && unlike(i, column) < unlike(i, before)) from = column;
        if (from != kNothing) centers[i] = centers[from];
      }
      if (centers[i].weight > 0.0f) before = column = i;
    }
  }
}

// By a rasteriser.
Status drawCenters(SplatDrawer& drawer, const CameraRays& camera, std::span<const PixelReceiver> receivers,
                   std::span<const Record> records, const Interpolation& interpolation, std::span<Splat> centers) {
  if (Status ok = drawer.look(camera, receivers); !ok) return ok;
  if (Status ok = drawer.draw(records, interpolation); !ok) return ok;
  return drawer.read(centers);
}

// Records splatted at the pixels' centres. Those that none reaches are lit by records that reach out farther.
Result<std::vector<Splat>> splatCenters(const CameraRays& camera, std::span<const PixelReceiver> receivers,
                                        std::span<const Record> records, const RecordTiles& tiles, SplatDrawer* drawer,
                                        const Interpolation& interpolation, PreviewFrame& frame, Context& context) {
  std::vector<Splat> centers(receivers.size());
  const auto splatAll = [&](const RecordTiles& by) {
    parallelChunks(context, "", frame.height, 4, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin * frame.width; i < end * frame.width; ++i) {
        if (!isMissing(receivers[i], centers[i])) continue;
        centers[i] = by.splat(static_cast<std::uint32_t>(i % frame.width), static_cast<std::uint32_t>(i / frame.width),
                              receivers[i]);
      }
    });
  };
  if (drawer != nullptr) {
    if (Status ok = drawCenters(*drawer, camera, receivers, records, interpolation, centers); !ok) return ok.error();
  } else {
    splatAll(tiles);
  }
  frame.weight.resize(centers.size());
  for (std::size_t i = 0; i < centers.size(); ++i) frame.weight[i] = centers[i].weight;
  frame.extended = countMissing(receivers, centers);
  Interpolation farther = interpolation;
  farther.limits = false;
  for (std::uint32_t missing = frame.extended; missing > 0 && farther.accuracy < kFarthest * interpolation.accuracy;
       missing = countMissing(receivers, centers)) {
    farther.accuracy *= kGrowth;
    splatAll(RecordTiles(camera, records, farther));
  }
  fillMissing(receivers, frame.width, centers);
  return centers;
}

// What the pixels' centres mirror, and the records by which they do.
struct Mirrors {
  std::vector<MirrorSurface> surfaces;   // [Size pixels]
  std::vector<PixelReceiver> receivers;  // of lobes that records carry [Size pixels]
  std::optional<LobeTable> lobes;
  std::optional<RadianceRecords> radiance;
  std::vector<Record> records;
  std::optional<RecordTiles> tiles;
  Interpolation interpolation;
  std::vector<MirrorSplat> drawn;  // by a rasteriser

  bool needRecords() const {
    return std::any_of(surfaces.begin(), surfaces.end(), [](const MirrorSurface& s) { return s.byRecords(); });
  }
};

// Bend the receivers' normals, and find those that need radiance records.
void findMirrorReceivers(const PreviewScene& scene, const CameraRays& camera, std::vector<PixelReceiver>& receivers,
                         Mirrors& mirrors, Context& context) {
  mirrors.surfaces = findMirrors(scene.drawn, camera, context);
  std::size_t sharp = 0;
  for (std::size_t i = 0; i < receivers.size(); ++i) {
    const MirrorSurface& surface = mirrors.surfaces[i];
    if (receivers[i].normal == glm::vec3(0.0f)) continue;
    if (surface.normal != receivers[i].normal) receivers[i].bent = surface.normal;
    sharp += surface.exponent > 0.0f && !surface.byRecords() ? 1 : 0;
  }
  mirrors.receivers = receivers;
  for (std::size_t i = 0; i < receivers.size(); ++i) {
    if (!mirrors.surfaces[i].byRecords()) mirrors.receivers[i].normal = glm::vec3(0.0f);
  }
  if (sharp > 0)
    context.message(Severity::info, "preview: " + std::to_string(sharp) +
                                        " pixels show surfaces smoother than a roughness of 0.395, too smooth for "
                                        "records; each of their sub-pixels mirrors along one ray: more --samples are "
                                        "less grainy");
}

// Receivers that scatter light: metals mirror all they reflect.
std::vector<PixelReceiver> diffuseReceivers(std::span<const PixelReceiver> receivers, const Mirrors& mirrors) {
  std::vector<PixelReceiver> diffuse(receivers.begin(), receivers.end());
  for (std::size_t i = 0; i < diffuse.size(); ++i) {
    if (mirrors.surfaces[i].diffuse == glm::vec3(0.0f)) diffuse[i].normal = glm::vec3(0.0f);
  }
  return diffuse;
}

// Place radiance records; they are read as printed, contradictions between them are not looked for.
void placeMirrors(const RecordGatherer& gatherer, const CameraRays& camera, const DrawHemispheres* draw,
                  const PreviewOptions& options, const Deadline& deadline, Mirrors& mirrors, PreviewFrame& frame,
                  Context& context) {
  float sharpest = 1.0f;
  std::vector<float> exponents;
  for (const MirrorSurface& surface : mirrors.surfaces) {
    exponents.push_back(surface.exponent);
    if (surface.byRecords()) sharpest = std::max(sharpest, surface.exponent);
  }
  const int order = options.glossyOrder > 0 ? options.glossyOrder : hshOrderOf(sharpest);
  PreviewOptions printed = options;
  printed.rounds = 0;
  printed.fewRecords = 0;
  const float farthest = options.timeLimitSeconds > 0.0 ? std::max(kCoarsest, options.accuracy) : options.accuracy;
  mirrors.lobes.emplace(order, LobeKind::mean, context);
  mirrors.radiance.emplace(gatherer.cells(), *mirrors.lobes, farthest, options.reach);
  const RecordKeeper keeper = mirrors.radiance->keeper(exponents);
  PreviewFrame timed;
  mirrors.interpolation =
      *place(gatherer, camera, mirrors.receivers, draw, &keeper, printed, deadline, mirrors.records, timed, context);
  mirrors.tiles.emplace(camera, mirrors.records, mirrors.interpolation);
  frame.glossyRecords = static_cast<std::uint32_t>(mirrors.records.size());
  frame.recordSeconds += timed.recordSeconds;
  frame.accuracy = std::max(frame.accuracy, timed.accuracy);
}

void setCenters(std::span<const PixelReceiver> receivers, const CameraRays& camera, PreviewFrame& frame) {
  for (std::size_t i = 0; i < receivers.size(); ++i) {
    const PixelReceiver& r = receivers[i];
    if (r.footprint <= 0.0f) continue;
    if (r.normal == glm::vec3(0.0f)) {
      frame.skipped += 1;
      continue;
    }
    frame.position[i] = r.positionWorld;
    frame.normal[i] = r.litNormal();
    frame.depth[i] = glm::dot(r.positionWorld - camera.origin, camera.forward);
  }
}

// The pixels whose surface has a record on it.
void markRecords(std::span<const Record> records, std::span<const PixelReceiver> receivers, const CameraRays& camera,
                 PreviewFrame& frame) {
  for (const Record& record : records) {
    const ScreenBox box = boxOfSphere(camera, record.positionWorld, 0.5f * record.footprint);
    for (std::uint32_t y = box.minY; y < box.maxY; ++y) {
      for (std::uint32_t x = box.minX; x < box.maxX; ++x) {
        const std::size_t pixel = std::size_t{y} * frame.width + x;
        const PixelReceiver& r = receivers[pixel];
        if (r.normal == glm::vec3(0.0f)) continue;
        if (glm::distance(r.positionWorld, record.positionWorld) < 0.25f * r.footprint) frame.recordAt[pixel] = 1.0f;
      }
    }
  }
}

void warn(const RecordGatherer& gatherer, const PreviewFrame& frame, const Scene& scene, Context& context) {
  if (gatherer.notFinite() > 0)
    context.message(Severity::warning,
                    "preview: " + std::to_string(gatherer.notFinite()) +
                        " rays found light that is no finite number and counts as none" +
                        (gatherer.notFiniteInstance() == kNone
                             ? std::string()
                             : "; the first part is \"" + scene.instances[gatherer.notFiniteInstance()].node + "\""));
  if (frame.skipped > 0)
    context.message(Severity::warning, "preview: " + std::to_string(frame.skipped) +
                                           " pixels show triangles without an area and get no indirect light");
}

void resize(PreviewFrame& frame, const PreviewOptions& options) {
  frame.width = options.width;
  frame.height = options.height;
  const std::size_t pixels = std::size_t{options.width} * options.height;
  for (auto* layer :
       {&frame.albedo, &frame.emission, &frame.direct, &frame.straight, &frame.bounced, &frame.position, &frame.normal})
    layer->assign(pixels, glm::vec3(0.0f));
  frame.depth.assign(pixels, 0.0f);
  frame.recordAt.assign(pixels, 0.0f);
  if (!options.gloss) return;
  frame.mirrored.assign(pixels, glm::vec3(0.0f));
  frame.highlights.assign(pixels, glm::vec3(0.0f));
}

}  // namespace

Result<PreviewFrame> renderPreview(const PreviewScene& scene, const HitRadiance& reflected,
                                   const PreviewOptions& options, std::vector<Record>& cache, Context& context) {
  if (Status ok = checkPreviewOptions(options); !ok) return ok.error();
  if (scene.draw != nullptr && options.hemisphere == Hemisphere::fan)
    return Error{
        ErrorCode::usage,
        "preview: a rasteriser draws the pixels of a plane; hemisphere must be plane, scaled or border, found fan"};
  const Context::Stage stage(context, "preview");
  PreviewFrame frame;
  resize(frame, options);

  // 1. What the pixels show; records of before, as this camera sees them
  const CameraRays camera(scene.camera, options.width, options.height);
  std::vector<PixelReceiver> receivers = findReceivers(scene.drawn, camera, context);
  std::optional<Mirrors> mirrors;
  if (options.gloss) findMirrorReceivers(scene, camera, receivers, mirrors.emplace(), context);
  setCenters(receivers, camera, frame);
  const std::vector<PixelReceiver> diffuse =
      mirrors ? diffuseReceivers(receivers, *mirrors) : std::vector<PixelReceiver>();
  const std::span<const PixelReceiver> lit = mirrors ? diffuse : receivers;
  const ReceiverMaker make(camera);
  for (Record& record : cache) {
    const float footprint = make.at({{}, record.positionWorld, record.normal, record.normal, false}).footprint;
    record.footprint = footprint > 0.0f ? footprint : record.footprint;
  }

  // 2. to 4. Records wherever there are none: those of mirrors in what is left of the time
  const Clock::time_point begin = Clock::now();
  const Deadline deadline = deadlineOf(options, begin, mirrors && mirrors->needRecords() ? kDiffuseShare : 1.0);
  std::optional<RecordGatherer> gatherer(std::in_place, scene.transport, reflected, scene.sky, gatherOptions(options));
  std::uint64_t raysBefore = 0;
  std::optional<Interpolation> placed =
      place(*gatherer, camera, lit, scene.draw, nullptr, options, deadline, cache, frame, context);
  if (!placed) {
    // Records of before are of this picture's accuracy as well, and would stay as they are.
    raysBefore = gatherer->raysTraced();
    const double first = frame.firstSeconds;
    const PreviewOptions finer = finerThan(options, cache.size());
    gatherer.emplace(scene.transport, reflected, scene.sky, gatherOptions(finer));
    cache.clear();
    placed = place(*gatherer, camera, lit, scene.draw, nullptr, finer, deadline, cache, frame, context);
    frame.recordSeconds += first;
    frame.firstSeconds = first;
  }
  const Interpolation interpolation = *placed;
  if (mirrors && !context.cancelled())
    placeMirrors(*gatherer, camera, scene.draw, options, deadlineOf(options, begin, 1.0), *mirrors, frame, context);
  if (context.cancelled()) return cancelledError();
  frame.records = static_cast<std::uint32_t>(cache.size());
  frame.rays = raysBefore + gatherer->raysTraced();

  // 5. All records on all pixels, and direct light
  const Clock::time_point splatBegin = Clock::now();
  const RecordTiles tiles(camera, cache, interpolation);
  const auto centers = splatCenters(camera, lit, cache, tiles, scene.splat, interpolation, frame, context);
  if (!centers) return centers.error();
  if (mirrors && scene.mirrors != nullptr) {
    mirrors->drawn.resize(receivers.size());
    if (Status ok = (*scene.mirrors)(camera, mirrors->receivers, mirrors->surfaces, mirrors->records,
                                     *mirrors->radiance, mirrors->interpolation, mirrors->drawn);
        !ok)
      return ok.error();
  }
  frame.splatSeconds = secondsSince(splatBegin);
  markRecords(cache, receivers, camera, frame);
  if (mirrors) markRecords(mirrors->records, receivers, camera, frame);
  const EmittingTriangles emitters(scene.transport.scene(), scene.transport.geometry());
  std::optional<MirrorInput> mirrored;
  if (mirrors)
    mirrored.emplace(MirrorInput{scene, *mirrors->radiance, mirrors->records, *mirrors->tiles, *mirrors->lobes,
                                 scene.sharp != nullptr ? *scene.sharp : reflected, scene.emissive, options.seed,
                                 mirrors->drawn, mirrors->surfaces});
  shadeFrame({scene, options, camera, tiles, receivers, *centers, scene.emissive ? &emitters : nullptr,
              mirrored ? &*mirrored : nullptr},
             frame, context);
  if (context.cancelled()) return cancelledError();
  warn(*gatherer, frame, scene.transport.scene(), context);
  context.figure("records", frame.records);
  return frame;
}

}  // namespace relume
