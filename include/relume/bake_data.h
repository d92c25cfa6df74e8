// SPDX-License-Identifier: MIT
// The whole bake: what the baker hands to the game. Plain data; see the headers of its parts for invariants, and
// include/relume/bake_file.h for the file.
#pragma once

#include "relume/caches.h"
#include "relume/certificate.h"
#include "relume/emitters.h"
#include "relume/hierarchy.h"
#include "relume/links.h"
#include "relume/surfels.h"

#include <array>
#include <cstdint>
#include <string>

namespace relume {

// A part of the scene by name, so that people and other tools can find it again.
struct BakedInstance {
  std::string node;      // glTF node name, or "unnamed node <k>": the k-th drawn one without, as the scene is walked
  std::string mesh;      // glTF mesh name, or "mesh<index>" when it has none
  std::string material;  // glTF material name, likewise; empty without a material
  std::uint64_t contentHash = 0;  // XXH3 of what follows, and of mode and texel density
  std::uint64_t transformHash = 0, geometryHash = 0, materialHash = 0;  // XXH3 of the world transform, of the mesh, of
                                                                        // the material and the texels it uses
  std::uint64_t topologyHash = 0;                // XXH3 of the mesh but for positions and normals
  std::uint32_t firstShape = 0, shapeCount = 0;  // blocks of Bake::shapes: positions and normals, up to noise
};

// What the bake was made from. No time, no path, no machine: the same input gives the same bytes.
struct Provenance {
  std::string toolVersion;             // semantic version of the baker
  std::uint32_t algorithmVersion = 0;  // raised whenever the same input would give other light
  std::string optionsJson;             // every option of the bake, canonical JSON
  std::uint64_t sceneHash = 0;         // XXH3 over the instances' hashes and viewHash, lights excluded
  std::uint64_t seed = 0;
  std::string rayTracer;                         // "embree 3.13.5 isa=avx2"
  std::uint32_t lumaBands = 4, chromaBands = 4;  // [1..8] what the baker recommends to the runtime
  std::uint64_t viewHash = 0;    // XXH3 of cameras and play volumes, which decide where light is looked for
  std::uint64_t cameraHash = 0;  // XXH3 of all cameras, those that only look among them
};

struct Bake {
  Surfels surfels;
  Hierarchy hierarchy;
  Caches caches;
  Links links;
  Array<BakedInstance> instances;  // indexed by Surfels::instance and Lightmap::parts
  Provenance provenance;
  Array<std::uint32_t> shapes;  // [Size kShapeWords * blocks] weighted sums over blocks of a mesh's vertices, from
                                // which the baker tells exporters' noise from change (bake/shape_sums.h)
  Emitters emitters;            // what a frame may light in another way
  Certificate certificate;      // how far its light is from the level's
};

inline constexpr std::uint32_t kShapeWords = 6;

}  // namespace relume
