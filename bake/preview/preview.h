// SPDX-License-Identifier: MIT
// A camera's view by splatted radiance records: Gautron, Krivanek, Bouatouch, Pattanaik, "Radiance Cache Splatting: A
// GPU-Friendly Global Illumination Algorithm", EGSR 2005 (RCS). Indirect light is gathered at few points, as many as
// the picture needs, and interpolated between them; direct light is traced at each pixel.
//
// In: a level's rays, a camera, lights, and the radiance that a record's ray finds (hit_radiance.h). Out: layers of
// radiance.
#pragma once

#include "bake/preview/draw_splats.h"
#include "bake/preview/gather.h"
#include "bake/preview/hit_radiance.h"
#include "bake/preview/place_records.h"
#include "bake/preview/record.h"
#include "bake/preview/weights.h"
#include "bake/rays/ray_tracer.h"
#include "bake/scene/sky.h"
#include "relume/bake/context.h"
#include "relume/result.h"

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

struct PreviewOptions {
  std::uint32_t width = 320, height = 180;  // [1..16384]
  std::uint32_t samples = 4;                // [1..16] sub-pixels along a side, box filter
  float accuracy = 0.15f;                   // [0.02..2] a of RCS: 0.15 and 0.1 in the paper, 0.5 while moving
  std::uint32_t rays = 1024;                // [16..65536] a record casts
  std::uint32_t fewRecords = 0;             // where fewer do: 2/3 of `accuracy`, 16/9 to 32/9 of `rays`; 0 = never
  float contrast = 0.1f;  // [0.001..10] by how much of its light records may differ at a pixel (adapt_reach.h)
  int rounds = 6;         // [0..16] in which those that differ by more are replaced; 0 = never, the paper's way
  RecordWeight weight = RecordWeight::smooth;
  RecordReach reach = RecordReach::guarded;
  float minPixels = 1.5f;  // [0..64] widths of a pixel that every record reaches
  bool gradients = true;
  PlacementOrder order = PlacementOrder::waves;
  Hemisphere hemisphere = Hemisphere::fan;
  std::uint32_t planeSide = 64;       // [2..256] pixels of the plane; the paper's
  float planeFovDeg = 126.87f;        // [10..175] that the plane spans
  std::uint32_t maxRecords = 200000;  // [1..10000000]
  std::uint32_t emitterRays = 32;     // [1..1024] shadow rays of a pixel toward emitters
  double timeLimitSeconds = 0.0;      // [>= 0] of all records; 0 = none
  bool gloss = false;                 // surfaces mirror as their materials say (relume/glossy.h), by radiance records
  int glossyOrder = 0;                // [0..10] of their hemispherical harmonics; 0 = as the sharpest lobe needs
  std::uint64_t seed = 1;
};

// What is looked at. All are kept by reference while a frame is rendered.
struct PreviewScene {
  const RayTracer& transport;  // what light travels among
  const RayTracer& drawn;      // what the camera sees, and what casts the punctual lights' shadows
  const Camera& camera;
  std::span<const SceneLight> lights;
  bool emissive = false;  // emitting surfaces are on
  const Sky& sky;
  const DrawHemispheres* draw = nullptr;  // what draws records' surroundings; null: rays look around
  SplatDrawer* splat = nullptr;           // what draws records at the pixels' centres; null: RecordTiles
  const DrawMirrors* mirrors = nullptr;   // what draws radiance records there; null: RadianceRecords
  const HitRadiance* sharp = nullptr;     // what single mirrored rays find; null: what records' rays do
};

// Pixel means by a box filter, row 0 on top [Size width * height]; radiances [W/m²/sr] are with albedo.
struct PreviewFrame {
  std::uint32_t width = 0, height = 0;
  std::vector<glm::vec3> albedo;
  std::vector<glm::vec3> emission;  // of surfaces that are on, and of the sky where nothing is seen
  std::vector<glm::vec3> direct;    // from punctual lights
  std::vector<glm::vec3> straight;  // from emitters and sky, unreflected
  std::vector<glm::vec3> bounced;   // by records: reflected at least once
  // With PreviewOptions::gloss what surfaces mirror, their reflectance included: of what surfaces reflect and of the
  // sky; and of punctual lights and emitters. Lobes that are too sharp for records have emitters in the former. albedo
  // is then what surfaces scatter, and normal bent by normal maps. Empty without.
  std::vector<glm::vec3> mirrored, highlights;
  std::vector<float> weight;                // sum of w_k at the pixel's centre
  std::vector<float> recordAt;              // 1 where the pixel has a record, else 0
  std::vector<glm::vec3> position, normal;  // at the pixel's centre, the normal toward the viewer; 0 where nothing is
  std::vector<float> depth;                 // [m] along the viewing axis

  float accuracy = 0.0f;            // that was reached: what was asked for, more with a time limit, or finer
  std::uint32_t records = 0;        // in the cache, those of before included
  std::uint32_t glossyRecords = 0;  // radiance records, of this frame alone
  std::uint64_t rays = 0;           // that records cast
  std::uint32_t extended = 0;       // pixels that no record reached, lit by records that reached out farther
  std::uint32_t skipped = 0;        // pixels of triangles without an area
  double recordSeconds = 0.0, firstSeconds = 0.0;  // of placing records; until every pixel had light for the first time
  double splatSeconds = 0.0;                       // of drawing all records at the pixels' centres
};

// Render a frame. `cache`: records of frames before, of the same scene, lights and options but for the camera; those
// that this one needs in addition are appended. The same picture at any thread count, but with a time limit, which
// makes records coarse to fine and keeps the finest that is complete: the coarsest is made whatever the time. Those of
// mirrors have the time that others leave, which have half of it where there are mirrors. Few records do not become
// finer then.
// usage: an option out of range, or a fan that is to be drawn; failed: cancelled. Errors of PreviewScene::splat and
// mirrors.
Result<PreviewFrame> renderPreview(const PreviewScene& scene, const HitRadiance& reflected,
                                   const PreviewOptions& options, std::vector<Record>& cache, Context& context);

}  // namespace relume
