// SPDX-License-Identifier: MIT
// See render_preview.h.
#include "tools/render/render_preview.h"

#include "bake/preview/surface_cells.h"
#include "bake/reference/emitters.h"
#include "tools/render/hemispheres_gl.h"
#include "tools/render/hit_light.h"
#include "tools/render/preview_splats_gl.h"
#include "tools/render/relight_by_rays.h"

#include <chrono>
#include <memory>
#include <optional>

namespace relume {
namespace {

class Stopwatch {
 public:
  // Seconds since the last call, or since the beginning.
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double seconds = std::chrono::duration<double>(now - last_).count();
    last_ = now;
    return seconds;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

PreviewOptions optionsOf(const PreviewRequest& request) {
  PreviewOptions options = request.options;
  options.width = request.frame.width;
  options.height = request.frame.height;
  options.samples = request.frame.samples;
  options.gloss = request.frame.gloss;
  return options;
}

// The same, lit by emitters alone and straight: of those, the first frame has nothing else.
RenderRequest emittersOf(const RenderRequest& request) {
  RenderRequest emitters = request;
  emitters.lights.clear();
  emitters.sky = Sky{};
  emitters.bounces = 1;
  return emitters;
}

// What draws records' surroundings.
Result<GlHemispheres> makeDrawer(const Scene& scene, const PreviewRequest& request) {
  const RenderRequest& frame = request.frame;
  if (frame.drawsEmission() || !frame.sky.isDark())
    return Error{ErrorCode::usage,
                 "--backend gl: shadow maps are of punctual lights alone; name those in --lights, without emissive, "
                 "and leave out "
                 "--sky and --emission"};
#ifdef RELUME_RENDER_GL
  return drawHemispheresByGl(scene, frame.lights, request.options, frame.shadowSize);
#else
  static_cast<void>(scene);
  return Error{ErrorCode::unsupported, "--backend gl: this relume was built without OpenGL"};
#endif
}

// What draws the records.
Result<GlPreviewSplats> makeSplatter() {
#ifdef RELUME_RENDER_GL
  return splatPreviewByGl();
#else
  return Error{ErrorCode::unsupported, "--backend gl: this relume was built without OpenGL"};
#endif
}

RenderedFrame toRenderedFrame(PreviewFrame&& preview, const RenderRequest& request) {
  RenderedFrame frame;
  frame.resize(request);
  frame.renderer = "cpu";
  frame.albedo = std::move(preview.albedo);
  frame.emission = std::move(preview.emission);
  frame.direct = std::move(preview.direct);
  frame.straight = std::move(preview.straight);
  frame.weight = std::move(preview.weight);
  frame.records = std::move(preview.recordAt);
  for (std::size_t i = 0; i < preview.mirrored.size(); ++i)
    frame.glossy[i] = preview.mirrored[i] + preview.highlights[i];
  for (std::size_t i = 0; i < frame.indirect.size(); ++i) frame.indirect[i] = preview.bounced[i] + frame.straight[i];
  if (request.centres) {
    frame.normal = std::move(preview.normal);
    frame.position = std::move(preview.position);
    frame.depth = std::move(preview.depth);
  }
  return frame;
}

}  // namespace

Result<RenderedFrame> renderPreviewFrame(const RayTracer& transport, const RayTracer& drawn,
                                         const PreviewRequest& request, PreviewReport& report, Context& context) {
  const Scene& scene = transport.scene();
  const RenderRequest& asked = request.frame;
  Stopwatch watch;

  // 1. What records' rays find
  Relit relit, straight;
  std::optional<EmittingTriangles> emitters;
  std::optional<DrawnEmitters> drawnEmitters;
  std::unique_ptr<const SurfelsOnDemand> surfels;
  HitRadiance reflected, exact;
  if (request.source == PreviewSource::direct || asked.bake == nullptr) {
    if (asked.drawsEmission()) emitters.emplace(scene, RayGeometry::fixed);
    reflected = directRadiance(transport, drawn, asked.lights, emitters ? &*emitters : nullptr, asked.sky,
                               request.options.seed);
  } else {
    context.progress("relight", 0.0);
    auto done = relightByRays(drawn, asked, context);
    if (context.cancelled()) return cancelledError();
    if (!done) return done.error();
    relit = std::move(*done);
    if (asked.drawsEmission() && request.source == PreviewSource::hits) emitters.emplace(scene, RayGeometry::fixed);
    if (emitters && !emitters->empty()) {
      auto emitted = relightByRays(drawn, emittersOf(asked), context);
      if (context.cancelled()) return cancelledError();
      if (!emitted) return emitted.error();
      straight = std::move(*emitted);
      drawnEmitters.emplace(DrawnEmitters{transport, *emitters, *straight.all, request.options.seed});
    }
    const DrawnEmitters* const byPoints = drawnEmitters ? &*drawnEmitters : nullptr;
    exact = linkRadiance(drawn, asked.lights, *asked.bake, *relit.all, byPoints);
    if (request.source == PreviewSource::surfels) {
      surfels = mapSurfels(scene, *asked.bake, context);
      if (context.cancelled()) return cancelledError();
      exact = reflected = surfelRadiance(*asked.bake, *relit.all, *surfels, std::move(exact));
    } else {
      reflected =
          cellRadiance(transport, exact, linkPatchRadiance(drawn, asked.lights, *asked.bake, *relit.all, byPoints),
                       request.options.seed, context);
      if (context.cancelled()) return cancelledError();
    }
  }
  report.relightSeconds = watch.lap();

  GlHemispheres hemispheres;
  if (request.drawn) {
    auto made = makeDrawer(scene, request);
    if (!made) return made.error();
    hemispheres = std::move(*made);
  }
  report.renderer = request.drawn ? "gl: " + hemispheres.renderer : "cpu";
  GlPreviewSplats splats;
  if (request.splatted) {
    auto made = makeSplatter();
    if (!made) return made.error();
    splats = std::move(*made);
  }
  report.splatsRenderer = request.splatted ? "gl: " + splats.renderer : "cpu";
  watch.lap();

  // 2. Records and the picture
  std::vector<Record> cache;
  auto preview = renderPreview({transport, drawn, asked.camera, asked.lights, asked.drawsEmission(), asked.sky,
                                request.drawn ? &hemispheres.draw : nullptr, splats.drawer.get(),
                                request.splatted ? &splats.mirrors : nullptr, exact ? &exact : nullptr},
                               reflected, optionsOf(request), cache, context);
  if (!preview) return preview.error();
  report.records = preview->records;
  report.glossyRecords = preview->glossyRecords;
  report.extended = preview->extended;
  report.rays = preview->rays;
  report.accuracy = preview->accuracy;
  report.firstSeconds = preview->firstSeconds;
  report.recordSeconds = preview->recordSeconds;
  report.splatSeconds = preview->splatSeconds;
  report.drawSeconds = watch.lap() - preview->recordSeconds;
  RenderedFrame frame = toRenderedFrame(std::move(*preview), asked);
  frame.frames = relit.frames;
  return frame;
}

}  // namespace relume
