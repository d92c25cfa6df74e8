// SPDX-License-Identifier: MIT
// See preview_level.h.
#include "tools/cli/preview_level.h"

#include "bake/bake_over_rays.h"
#include "bake/stage_memory.h"
#include "relume/bake/options.h"
#include "tools/compare/fit_bake.h"

#include <algorithm>
#include <functional>
#include <future>
#include <utility>

namespace relume {
namespace {

// A draft over rays that are there; nothing, and `source` is direct, where none can be made. The rays are gone then.
Result<std::optional<Bake>> makeDraft(const PreviewLevelOptions& options, const Scene& scene,
                                      std::optional<RayTracer>& rays, PreviewSource& source, Context& context) {
  // What a draft has to say of texels and faces is for who bakes.
  std::function<void(Severity, std::string_view)> listener;
  std::swap(listener, context.onMessage);
  auto draft = bakeOverRays(scene, presetOptions(Preset::draft), rays, context);
  std::swap(listener, context.onMessage);
  if (draft) return std::optional<Bake>(std::move(*draft));
  if (context.cancelled() || options.needsBake) return draft.error();
  context.message(Severity::warning,
                  draft.error().message + "; so there is no draft bake, and light is reflected once alone");
  source = PreviewSource::direct;
  return std::optional<Bake>();
}

bool hasDynamicParts(const Scene& scene) {
  return std::any_of(scene.instances.begin(), scene.instances.end(),
                     [](const Instance& instance) { return !instance.baked(); });
}

Result<RayTracer> traceThrough(const Scene& scene, RayStructure structure, RayGeometry geometry, Context& context) {
  context.progress("rays", 0.0);
  if (Status ok = reserveRays(scene, structure, context, geometry); !ok) return ok.error();
  return RayTracer::create(scene, BakeOptions{}.embreeIsa, context, structure, geometry);
}

}  // namespace

Result<PreviewLevel> makePreviewLevel(const Scene& scene, const PreviewLevelOptions& options, PreviewSource& source,
                                      Context& context) {
  PreviewLevel level;
  const bool isNamed = source != PreviewSource::direct && !options.bake.empty();
  std::optional<Result<Bake>> read;
  const auto readBake = [&] { read = readBakeOf(scene, options.bake, options.scene, options.allowStale, context); };
  std::future<void> reading;
  // Where the system has no thread to spare it is read once rays are built.
  if (isNamed)
    reading =
        std::async(context.threads == 1 ? std::launch::deferred : std::launch::async | std::launch::deferred, readBake);
  auto transport = traceThrough(scene, options.structure, RayGeometry::fixed, context);
  if (isNamed) {
    reading.get();
    if (!*read) return read->error();
    level.bake.emplace(std::move(**read));
  }
  if (!transport) return transport.error();
  level.transport.emplace(std::move(*transport));
  if (source != PreviewSource::direct && !isNamed) {
    auto draft = makeDraft(options, scene, level.transport, source, context);
    if (!draft) return draft.error();
    level.bake = std::move(*draft);
    if (!level.transport) {
      auto again = traceThrough(scene, options.structure, RayGeometry::fixed, context);
      if (!again) return again.error();
      level.transport.emplace(std::move(*again));
    }
  }
  if (!hasDynamicParts(scene)) return level;
  const RayStructure packets =
      options.structure == RayStructure::bundles ? RayStructure::thorough : RayStructure::quick;
  auto drawn = traceThrough(scene, packets, RayGeometry::drawn, context);
  if (!drawn) return drawn.error();
  level.withDynamic.emplace(std::move(*drawn));
  return level;
}

}  // namespace relume
