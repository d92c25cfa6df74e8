// SPDX-License-Identifier: MIT
// `relume preview`: a view by radiance records, whose rays find direct light alone or a relit bake.
#pragma once

#include "bake/preview/preview.h"
#include "relume/bake/context.h"
#include "relume/bake/scene.h"
#include "relume/result.h"
#include "tools/render/render_frame.h"

#include <cstdint>
#include <string>

namespace relume {

// What records' rays find where they end. direct: light that is reflected once, as RCS has it. hits: direct light and
// the relit bake's light map or grid. surfels: the radiosity of the relit bake's surfels.
enum class PreviewSource { direct, hits, surfels };

struct PreviewRequest {
  RenderRequest frame;  // its bake is needed but for `direct`; bounces, bands and exponent have no meaning
  PreviewOptions options;
  PreviewSource source = PreviewSource::hits;
  bool drawn = false;     // OpenGL draws what records see, with shadow maps; source must be `direct`
  bool splatted = false;  // OpenGL draws the records at the pixels' centres
};

// What a preview took.
struct PreviewReport {
  std::uint32_t records = 0, glossyRecords = 0, extended = 0;
  std::uint64_t rays = 0;
  float accuracy = 0.0f;
  double relightSeconds = 0.0, firstSeconds = 0.0, recordSeconds = 0.0, splatSeconds = 0.0, drawSeconds = 0.0;
  std::string renderer;        // what drew the records' surroundings: cpu, or OpenGL's name
  std::string splatsRenderer;  // what drew the records, likewise
};

// `transport` has what light travels among, best with RayStructure::bundles; `drawn`, of the same scene, has what is
// seen and what casts the punctual lights' shadows: dynamic instances, of which no other light knows, as in `render`.
// unsupported: `drawn` or `splatted`, and no OpenGL 4.3; usage: `drawn`, and light that shadow maps have not.
// Errors of the relighter and of renderPreview(); failed: cancelled.
Result<RenderedFrame> renderPreviewFrame(const RayTracer& transport, const RayTracer& drawn,
                                         const PreviewRequest& request, PreviewReport& report, Context& context);

}  // namespace relume
