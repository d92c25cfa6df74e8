// SPDX-License-Identifier: MIT
// See rsm_light.h.
#include "runtime/live/rsm_light.h"

#include "formats/color.h"
#include "formats/frame_about.h"
#include "formats/limits.h"
#include "runtime/live/cell_set.h"
#include "runtime/live/rsm_bounces.h"
#include "runtime/shared/chunks.h"
#include "runtime/shared/stopwatch.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <new>

namespace relume {
namespace {

constexpr std::uint32_t kReceivers = 256, kRsmCellsAtOnce = 4096;  // of a chunk
// Length of sampled secondary rays over the longest side, as the authors' shaders have it: longer ones would have their
// few samples farther apart. Exact ones end where they meet something.
constexpr float kFar = 0.5f;
constexpr float kAcross = 2.0f;  // over the longest side, more than a volume's diagonal
constexpr float kMaxFactor = 100.0f;
constexpr std::size_t kReads = 4;  // places that a receiver reads

Error rsmError(const std::string& what) { return {ErrorCode::usage, "live light by reflective shadow maps: " + what}; }

bool isFactor(float v) { return v >= 0.0f && v <= kMaxFactor; }

Status checkCount(const char* what, std::uint32_t found, std::uint32_t most) {
  if (found >= 1 && found <= most) return done();
  return rsmError(std::to_string(found) + " " + what + ", expected 1 to " + std::to_string(most));
}

// Where a receiver reads, from its own place [cells]: half a cell along the normal, and on a ring of half a cell around
// that. No move is longer than half a cell along any axis, so that all cells that are read are the receiver's own or
// neighbours of it, which dilation has made active.
//
// Deviation: CRC 2.2 has a number of places in the hemisphere and Section 3 moves all by half a cell along the normal.
std::array<glm::vec3, kReads> readPlaces(const glm::vec3& normal) {
  const glm::mat3 frame = frameAbout(normal);
  const glm::vec3 &t = frame[0], &s = frame[1];
  const glm::vec3 up = 0.5f * normal;
  const auto near = [](const glm::vec3& move) { return glm::clamp(move, -0.5f, 0.5f); };
  return {near(up), near(up + 0.5f * t), near(up - 0.25f * t + 0.4330127f * s), near(up - 0.25f * t - 0.4330127f * s)};
}

// Presence and bleeding of a cell.
void scaleCell(const RsmFrame& frame, const VolumeGrid& grid, std::uint32_t cell, CellField& field) {
  float presence = frame.presence, bleeding = frame.bleeding;
  const glm::vec3 middle = grid.toWorld(static_cast<float>(kBrickSide) * (glm::vec3(grid.cellAt(cell)) + 0.5f));
  for (const RsmArea& area : frame.areas) {
    const bool isIn = glm::clamp(middle, area.boxMin, area.boxMax) == middle;
    presence *= isIn ? area.presence : 1.0f;
    bleeding *= isIn ? area.bleeding : 1.0f;
  }
  if (presence == 1.0f && bleeding == 1.0f) return;
  presence = std::min(presence, kMaxFactor * kMaxFactor);
  bleeding = std::min(bleeding, kMaxFactor * kMaxFactor);
  float* const numbers = field.at(cell);
  for (std::size_t i = 0; i < field.lumaCount(); ++i) numbers[i] *= presence;
  for (std::size_t i = field.lumaCount(); i < field.count(); ++i) numbers[i] *= presence * bleeding;
}

}  // namespace

float averageAlbedoOf(const VoxelVolume& volume) {
  double sum = 0.0, area = 0.0;
  const std::vector<float> areas = volume.areas();
  volume.forSides(0, volume.sideCount(), [&](const SideAt& at) {
    sum += static_cast<double>(areas[at.index]) * rgbToYCoCg(at.side.albedo).x;
    area += areas[at.index];
  });
  return area > 0.0 ? static_cast<float>(sum / area) : 0.0f;
}

Result<RsmLight> RsmLight::create(const RsmOptions& options) {
  const Bands& bands = options.bands;
  if (bands.luma < 1 || bands.luma > kMaxFieldBands || bands.chroma < 1 || bands.chroma > bands.luma)
    return rsmError(std::to_string(bands.luma) + " bands of luma and " + std::to_string(bands.chroma) +
                    " of chroma, expected 1 to " + std::to_string(kMaxFieldBands) + ", chroma at most luma");
  if (Status ok = checkCount("samples", options.samples, 4096); !ok) return ok.error();
  if (Status ok = checkCount("secondary rays", options.secondaryRays, 4096); !ok) return ok.error();
  if (Status ok = checkCount("samples of a way", options.marchSamples, 64); !ok) return ok.error();
  if (Status ok = checkCount("samples of a secondary ray", options.secondarySamples, 64); !ok) return ok.error();
  if (options.bounces < 1 || options.bounces > 64)
    return rsmError(std::to_string(options.bounces) + " bounces, expected 1 to 64");
  if (options.occupancy == CellOccupancy::depth && options.bounces > 1)
    return rsmError("occupancy by depth serves one bounce, " + std::to_string(options.bounces) +
                    " are asked for: what the camera does not see sends light as well");
  return RsmLight(options);
}

void RsmLight::reset() {
  shown_.numbers.clear();
  active_.clear();
}

Status RsmLight::check(const RsmFrame& frame) const {
  if (!(frame.keep >= 0.0f && frame.keep < 1.0f)) return rsmError("keep is outside of 0 to 1, 1 not included");
  if (!(frame.averagedFrames >= 1.0f && frame.averagedFrames <= 1e6f))
    return rsmError("averagedFrames is outside of 1 to 1e6");
  if (frame.averageAlbedo && !(*frame.averageAlbedo >= 0.0f && *frame.averageAlbedo <= 1.0f))
    return rsmError("averageAlbedo is outside of 0 to 1");
  if (!isFactor(frame.presence) || !isFactor(frame.bleeding))
    return rsmError("presence or bleeding is outside of 0 to 100");
  for (std::size_t i = 0; i < frame.areas.size(); ++i) {
    const RsmArea& area = frame.areas[i];
    if (!isFactor(area.presence) || !isFactor(area.bleeding) || !isWithin(area.boxMin, kMaxCoordinate) ||
        !isWithin(area.boxMax, kMaxCoordinate))
      return rsmError("area " + std::to_string(i) + " has a number that is not finite or out of its range");
  }
  if (options_.occupancy == CellOccupancy::depth) {
    if (frame.depth == nullptr) return rsmError("occupancy by depth needs RsmFrame::depth");
    if (Status ok = checkDepthView(*frame.depth); !ok) return ok;
  }
  return checkRsm(frame.images);
}

std::vector<std::uint8_t> RsmLight::findCells(const VoxelVolume& volume, const RsmFrame& frame) const {
  const VolumeGrid& grid = volume.grid();
  if (options_.occupancy == CellOccupancy::none) return std::vector<std::uint8_t>(grid.cellCount(), 1);
  return dilate(
      grid, options_.occupancy == CellOccupancy::depth ? seenCells(grid, *frame.depth) : occupiedCells(volume.bits()));
}

// Deviation: print receives anywhere in a cell, half of which may lie behind a wall; sparse samples let light through
// to there. Where they are exact, a cell receives at the free voxel from which the fewest backs are seen (cell_set.h).
void RsmLight::findPlaces(const VoxelVolume& volume) {
  if (options_.visibility != CellVisibility::exact) return;
  if (standingVersion_ == volume.standingVersion() && movingVersion_ == volume.movingVersion() && !places_.empty())
    return;
  const CellSet cells = relume::findCells(volume);
  std::vector<glm::vec3> places(volume.grid().cellCount());
  for (std::uint32_t c = 0; c < places.size(); ++c) {
    const glm::vec3 middle = static_cast<float>(kBrickSide) * (glm::vec3(volume.grid().cellAt(c)) + 0.5f);
    places[c] = cells.slot[c] != kInactive ? cells.positionOf(cells.slot[c]) : middle;
  }
  places_ = std::move(places);
  standingVersion_ = volume.standingVersion();
  movingVersion_ = volume.movingVersion();
}

Status RsmLight::update(const VoxelVolume& volume, const RsmFrame& frame) {
  if (Status ok = check(frame); !ok) return ok;
  try {
    // 1. Which cells hold light
    Stopwatch watch;
    const VolumeGrid grid = volume.grid();
    const std::vector<std::uint8_t> isActive = findCells(volume, frame);
    std::vector<std::uint32_t> cells;
    for (std::uint32_t c = 0; c < isActive.size(); ++c) {
      if (isActive[c] != 0) cells.push_back(c);
    }
    findPlaces(volume);
    const double occupancyMs = watch.lap();

    // 2. The first bounce
    clearField(options_.bands, grid.cellCount(), first_);
    for (const std::uint32_t c : cells) first_.at(c)[first_.count()] = 1.0f;
    std::vector<RsmSample> samples = drawSamples(frame.images, options_.samples, frame.sampleSet);
    for (RsmSample& sample : samples) sample.softening /= frame.averagedFrames;
    CellOcclusion occlusion{grid, volume.bits(), options_.visibility, options_.marchSamples, places_};
    gatherFirstBounce(samples, occlusion, cells, volume.parallelFor(), first_);
    const double firstMs = watch.lap();

    // 3. Bounces between the cells; two fields take turns
    now_ = first_;
    if (options_.bounces > 1) next_ = first_;
    occlusion.samples = options_.secondarySamples;
    const glm::ivec3 size = grid.voxels();
    const float share = options_.visibility == CellVisibility::exact ? kAcross : kFar;
    SecondaryRays rays{options_.secondaryRays, share * static_cast<float>(std::max({size.x, size.y, size.z})), 0.0f,
                       frame.sampleSet};
    if (options_.bounces > 1) rays.averageAlbedo = frame.averageAlbedo ? *frame.averageAlbedo : averageAlbedoOf(volume);
    for (int bounce = 1; bounce < options_.bounces; ++bounce) {
      gatherNextBounce(first_, now_, rays, occlusion, cells, volume.parallelFor(), next_);
      std::swap(now_, next_);
    }
    const double nextMs = watch.lap();

    // 4. Blend with the frame before
    const bool isSame = shown_.numbers.size() == now_.numbers.size() && grid_.cells == grid.cells &&
                        grid_.originWorld == grid.originWorld && grid_.voxel == grid.voxel;
    const auto count = now_.count();
    forChunks(volume.parallelFor(), static_cast<std::uint32_t>(cells.size()), kRsmCellsAtOnce,
              [&](std::uint32_t begin, std::uint32_t end) {
                for (std::uint32_t i = begin; i < end; ++i) {
                  scaleCell(frame, grid, cells[i], now_);
                  if (!isSame || !shown_.isActive(cells[i])) continue;
                  float* const to = now_.at(cells[i]);
                  const float* const before = shown_.at(cells[i]);
                  for (std::size_t k = 0; k < count; ++k) to[k] += frame.keep * (before[k] - to[k]);
                }
              });
    grid_ = grid;
    parallelFor_ = volume.parallelFor();
    std::swap(shown_, now_);
    active_ = std::move(cells);
    samplesDrawn_ = static_cast<std::uint32_t>(samples.size());
    blendMs_ = watch.lap();
    occupancyMs_ = occupancyMs;
    firstMs_ = firstMs;
    nextMs_ = nextMs;
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::memory, "live light by reflective shadow maps: memory ran out; fewer cells take less"};
  }
  return done();
}

bool RsmLight::read(const glm::vec3& positionWorld, const glm::vec3& normal, FieldNumbers& sum, int& missed) const {
  if (active_.empty() || !isWithin(positionWorld, kMaxCoordinate) || !(glm::dot(normal, normal) < 4.0f)) return false;
  const glm::vec3 at = grid_.toGrid(positionWorld) / static_cast<float>(kBrickSide);
  int found = 0;
  for (const glm::vec3& place : readPlaces(normal)) {
    if (addField(shown_, grid_, at + place, sum, &missed)) ++found;
  }
  if (found == 0) return false;
  for (float& number : sum) number /= static_cast<float>(found);
  return true;
}

glm::vec3 RsmLight::irradiance(const glm::vec3& positionWorld, const glm::vec3& normal) const {
  FieldNumbers sum{};
  int missed = 0;
  if (!read(positionWorld, normal, sum, missed)) return glm::vec3(0.0f);
  glm::vec3 e = irradianceOf(shown_, sum, clampedLobe(normal));
  // Deviation: one band of chroma beside more of luma follows luma, as in baked caches (runtime/shared/resolve.h), so
  // that a surface that faces away from the light is not all colour.
  const std::size_t luma = shown_.lumaCount();
  if (shown_.chromaCount() == 1 && luma > 1 && sum[0] > 0.0f) {
    e.y = e.x * (sum[luma] / sum[0]);
    e.z = e.x * (sum[luma + 1] / sum[0]);
  }
  return glm::max(yCoCgToRgb(e), glm::vec3(0.0f));
}

int RsmLight::missedReads(const glm::vec3& positionWorld, const glm::vec3& normal) const {
  FieldNumbers sum{};
  int missed = 0;
  read(positionWorld, normal, sum, missed);
  return missed;
}

void RsmLight::resolve(std::span<const glm::vec3> positionWorld, std::span<const glm::vec3> normal,
                       std::span<glm::vec3> irradianceOut) {
  Stopwatch watch;
  forChunks(parallelFor_, static_cast<std::uint32_t>(positionWorld.size()), kReceivers,
            [&](std::uint32_t begin, std::uint32_t end) {
              for (std::uint32_t i = begin; i < end; ++i) irradianceOut[i] = irradiance(positionWorld[i], normal[i]);
            });
  resolveMs_ = watch.lap();
}

float RsmLight::occupancy() const {
  return grid_.cellCount() > 0 ? static_cast<float>(active_.size()) / static_cast<float>(grid_.cellCount()) : 0.0f;
}

std::vector<PassTime> RsmLight::passTimes() const {
  return {{"occupancy", occupancyMs_},
          {"first bounce", firstMs_},
          {"next bounces", nextMs_},
          {"blend", blendMs_},
          {"resolve", resolveMs_}};
}

std::vector<std::pair<std::string, std::size_t>> RsmLight::bufferSizes() const {
  return {{"cell light", shown_.numbers.size() * sizeof(float)},
          {"bounces", (first_.numbers.size() + now_.numbers.size() + next_.numbers.size()) * sizeof(float)},
          {"active cells", active_.size() * sizeof(active_[0])}};
}

}  // namespace relume
