// SPDX-License-Identifier: MIT
// Indirect light without a bake as CRC prints it (Vardis et al. 2014): the first bounce from reflective shadow maps
// into spherical harmonics of the cells that need them, later ones between the cells with one albedo for the whole
// level, and chroma in fewer bands than luma. runtime/live/live_caches.h gathers from lit voxels instead.
//
// A frame: occupancy, first bounce, next bounces, blend; then receivers read. All is made anew in every frame but what
// the blend keeps.
//
// Threads: as a Relighter's (relume/relighter.h), with the CPU backend.
#pragma once

#include "relume/relighter.h"
#include "relume/result.h"
#include "runtime/live/cell_field.h"
#include "runtime/live/cell_visibility.h"
#include "runtime/live/occupancy.h"
#include "runtime/live/rsm_image.h"
#include "runtime/voxels/voxel_volume.h"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace relume {

enum class CellOccupancy {
  none,    // all cells hold light
  voxels,  // those with occupied voxels, and their neighbours
  depth,   // those that the camera sees, and their neighbours: for one bounce
};

struct RsmOptions {
  Bands bands{3, 2};                   // luma 1..3, chroma 1..luma
  std::uint32_t samples = 100;         // [1..4096] n_s of CRC Eq. (2), of all maps together (CRC: 50 to 200)
  std::uint32_t secondaryRays = 32;    // [1..4096] n of CRC Eq. (4)
  std::uint32_t marchSamples = 12;     // [1..64] of a way of the first bounce, where sampled (CRC Section 6: 8 to 12)
  std::uint32_t secondarySamples = 6;  // [1..64] of a ray of the next ones (CRC Section 6: 4 to 6)
  CellVisibility visibility = CellVisibility::sampled;
  CellOccupancy occupancy = CellOccupancy::voxels;
  int bounces = 2;  // [1..64] how often light is reflected; 1 with occupancy by depth
};

// Artist's factors for the cells whose middle lies in a box (CRC Section 4).
struct RsmArea {
  glm::vec3 boxMin{0.0f}, boxMax{0.0f};  // [m]
  float presence = 1.0f;                 // [0..100] of all indirect light
  float bleeding = 1.0f;                 // [0..100] of its colour
};

struct RsmFrame {
  std::span<const RsmImage> images;      // of each light that is on
  const DepthView* depth = nullptr;      // what the camera sees; read with CellOccupancy::depth alone
  std::optional<float> averageAlbedo{};  // [0..1] of the level; empty = of the voxels' sides by area
  float keep = 0.0f;                     // [0..1) share of last frame's light that stays: exp(-seconds / 0.15)
  std::uint32_t sampleSet = 0;           // which samples are drawn: count the frames, or leave it for printed CRC
  // [1..1e6] over how many frames of other samples the light is averaged: a sample then stands for so much less area,
  // and light from near by is bounded less (RsmSample::softening).
  float averagedFrames = 1.0f;
  float presence = 1.0f, bleeding = 1.0f;  // [0..100] factors on all cells, with those of the areas
  std::span<const RsmArea> areas{};
};

class RsmLight {
 public:
  // usage: an option out of its range.
  static Result<RsmLight> create(const RsmOptions& options);

  // A frame. Cells that have just become active begin with what they gather now. usage: checkRsm(), checkDepthView(), a
  // number of the frame that is not finite or out of its range, no depth where it is needed; memory: it ran out. Last
  // frame's light stays then.
  [[nodiscard]] Status update(const VoxelVolume& volume, const RsmFrame& frame);
  void reset();

  // Irradiance [W/m²] by light that is reflected at least once. Finite and never negative; zero where no active cell is
  // near, and where position or normal is not finite.
  [[nodiscard]] glm::vec3 irradiance(const glm::vec3& positionWorld, const glm::vec3& normal) const;
  // Of many receivers, on the threads of the last update's volume. [sizes equal]
  void resolve(std::span<const glm::vec3> positionWorld, std::span<const glm::vec3> normal,
               std::span<glm::vec3> irradianceOut);
  // How many of the cells that a receiver at such a place reads are in the volume and not active.
  [[nodiscard]] int missedReads(const glm::vec3& positionWorld, const glm::vec3& normal) const;

  const CellField& field() const { return shown_; }
  const VolumeGrid& grid() const { return grid_; }
  std::span<const std::uint32_t> activeCells() const { return active_; }
  // Of the last frame: share of cells that are active, and samples that reflect light.
  float occupancy() const;
  std::uint32_t samplesDrawn() const { return samplesDrawn_; }
  std::vector<PassTime> passTimes() const;
  std::vector<std::pair<std::string, std::size_t>> bufferSizes() const;

 private:
  explicit RsmLight(const RsmOptions& options) : options_(options) { shown_.bands = options.bands; }
  Status check(const RsmFrame& frame) const;
  std::vector<std::uint8_t> findCells(const VoxelVolume& volume, const RsmFrame& frame) const;
  void findPlaces(const VoxelVolume& volume);
  bool read(const glm::vec3& positionWorld, const glm::vec3& normal, FieldNumbers& sum, int& missed) const;

  RsmOptions options_;
  VolumeGrid grid_;
  ParallelFor parallelFor_;
  CellField shown_;                    // what receivers read: all bounces, blended over the frames
  CellField first_, now_, next_;       // of a frame, while it is made
  std::vector<std::uint32_t> active_;  // cells
  std::uint32_t samplesDrawn_ = 0;
  // With exact visibility: where the cells receive light, of the volume at these versions. [voxels] [Size cells]
  std::vector<glm::vec3> places_;
  std::uint64_t standingVersion_ = 0, movingVersion_ = 0;
  double occupancyMs_ = 0.0, firstMs_ = 0.0, nextMs_ = 0.0, blendMs_ = 0.0, resolveMs_ = 0.0;
};

// The mean albedo of a volume's sides by the area of what they stand for: luma.
float averageAlbedoOf(const VoxelVolume& volume);

}  // namespace relume
