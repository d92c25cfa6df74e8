// SPDX-License-Identifier: MIT
// See bake_on_gpu.h.
#include "tools/view/bake_on_gpu.h"

#include <algorithm>
#include <thread>

namespace relume {
namespace {

Result<BakeVoxelsGl> voxelsOf(const Relighter& relighter, const GetProcAddress& getProcAddress) {
  return BakeVoxelsGl::create({relighter.lumaBands(), relighter.chromaBands(), getProcAddress, ShadowMaps::glsl()});
}

}  // namespace

BakeOnGpu::BakeOnGpu(const LoadedLevel& level, std::uint32_t cells, BakeVoxelsGl voxels, GetProcAddress getProcAddress)
    : level_(&level),
      nodes_(movingNodes(level.scene, level.movable())),
      cells_(cells),
      getProcAddress_(std::move(getProcAddress)),
      voxels_(std::move(voxels)),
      threads_(std::make_unique<WorkerThreads>(std::max(1u, std::thread::hardware_concurrency()))),
      driven_(level) {}

Result<std::unique_ptr<BakeOnGpu>> BakeOnGpu::create(const LoadedLevel& level, std::uint32_t cells,
                                                     const Relighter& relighter, const GetProcAddress& getProcAddress) {
  auto voxels = voxelsOf(relighter, getProcAddress);
  if (!voxels) return voxels.error();
  return std::unique_ptr<BakeOnGpu>(new BakeOnGpu(level, cells, std::move(*voxels), getProcAddress));
}

Status BakeOnGpu::use(const Relighter& relighter) {
  auto voxels = voxelsOf(relighter, getProcAddress_);
  if (!voxels) return voxels.error();
  voxels_ = std::move(*voxels);
  return done();
}

// Voxels anew, of what emits now. Those before are lit until they are there.
void BakeOnGpu::begin(const ViewState& state) {
  job_.reset();
  driven_.drive(state);
  job_ = std::make_unique<LiveJob>(driven_.scene(), LiveLevelOptions{.cells = cells_, .backend = BackendKind::gl});
  isComing_ = true;
}

Status BakeOnGpu::take(std::unique_ptr<VoxelVolume> volume) {
  // The threads of the job that has found it go on with the next.
  volume->useParallelFor(threads_->parallelFor());
  if (!volume_ || volume->standingVersion() != volume_->standingVersion()) {
    auto surfels = SurfelVoxels::create(*volume, level_->bake);
    if (!surfels) return surfels.error();
    surfels_.emplace(std::move(*surfels));
  }
  volume_ = std::move(volume);
  return done();
}

Status BakeOnGpu::update(const BakeFrame& frame, std::span<const glm::mat4> moved, const ShadowMaps& shadows) {
  const bool waits = frame.state.liveStep > 0.0;
  // While a colour is dragged, each that was begun with is found before the next.
  if (!job_ || ((waits || !isComing_) && !driven_.isOf(frame.state))) begin(frame.state);
  LiveScene scene;
  if (std::ranges::any_of(moved, [](const glm::mat4& m) { return m != glm::mat4(1.0f); }))
    scene.toWorld = placedInstances(level_->scene, nodes_, moved);
  std::optional<Result<LitFrame>> found;
  if (waits) {
    job_->followOnce(std::move(scene), 1.0, true);
    found.emplace(job_->wait());
  } else {
    job_->follow(std::move(scene), true);
    found = job_->take();
  }
  if (found) isComing_ = false;
  if (found && !*found) return found->error();
  if (found && (*found)->hasCopies()) {
    if (Status ok = take(std::move((*found)->volumes.front().copy)); !ok) return ok;
  }
  if (!volume_) return done();
  if (!isComing_ && driven_.isOf(frame.state)) emission_ = DrivenScene::factorOf(frame.state);
  shadows.setUniforms(voxels_.directProgram());
  shadows.bind();
  if (Status ok = voxels_.light(*volume_, *surfels_, frame.inputs, frame.lights, glm::vec3(emission_)); !ok) return ok;
  ++number_;
  return done();
}

std::vector<std::pair<std::string, std::size_t>> BakeOnGpu::bufferSizes() const {
  auto sizes = voxels_.bufferSizes();
  if (!volume_) return sizes;
  for (auto& [name, bytes] : volume_->bufferSizes()) sizes.emplace_back("CPU: " + name, bytes);
  return sizes;
}

}  // namespace relume
