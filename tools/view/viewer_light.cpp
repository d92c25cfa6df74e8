// SPDX-License-Identifier: MIT
// The light of a viewer with a bake, its voxels, and what cones find in those or in live light's. See viewer.h.
#include "tools/view/viewer.h"

#include "tools/render/read_sky_map.h"

#include <algorithm>

namespace relume {
namespace {

// A relighter of those bands that begins with the light of `previous`, which may be null.
Result<Relighter> makeRelighter(const Bake& bake, RelightOptions options, const Bands& bands,
                                const Relighter* previous) {
  options.lumaBands = bands.luma;
  options.chromaBands = bands.chroma;
  auto relighter = Relighter::create(bake, options);
  if (!relighter || !previous) return relighter;
  const Status inherited = relighter->inherit(*previous, bake);
  // A bake without a grid has nothing to hand over.
  if (!inherited && inherited.error().code != ErrorCode::unsupported) return inherited.error();
  return relighter;
}

// What the state drives of the bake's materials; keepOthers: whether the rest shines as it did, or not at all.
std::vector<MaterialEmission> emissionsOf(const Emitters& emitters, const ViewState& state, bool keepOthers) {
  std::vector<MaterialEmission> list;
  for (std::uint32_t m = 0; m < emitters.materials.size(); ++m) {
    const auto driven = std::ranges::find_if(
        state.emitters, [&](const ViewedEmitter& e) { return e.isDriven && e.name == emitters.materials[m].name; });
    const bool isDriven = driven != state.emitters.end();
    if (!isDriven && keepOthers) continue;
    MaterialEmission& emission = list.emplace_back();
    emission.material = m;
    emission.radiance = isDriven ? driven->radiance : glm::vec3(0.0f);
    if (isDriven) emission.image = driven->image;
  }
  return list;
}

}  // namespace

Status Viewer::choose(const RelightChoice& choice) {
  return live_ || choice == choice_ ? done() : build(choice, &relighter());
}

// Relighter and programs of a choice, in place of those that are there.
Status Viewer::build(const RelightChoice& choice, const Relighter* previous) {
  const bool byCpu = choice.backend == BackendKind::cpu;
  RelightOptions options = options_;
  options.movingParts = byCpu ? 0 : parts_.count();
  auto relighter = makeRelighter(*bake_, options, choice.bands, previous);
  if (!relighter) return relighter.error();
  Shading shading;
  if (auto program = shading.program(shownKind_, &*relighter); !program) return program.error();
  std::optional<CpuLight> cpu;
  if (byCpu) {
    RelightOptions cpuOptions;
    cpuOptions.drivenImages = options_.drivenImages;
    cpuOptions.movingParts = parts_.count();
    auto made = CpuLight::create(loaded_->scene, *bake_, *relighter, previous, cpuOptions, loaded_->movable());
    if (!made) return made.error();
    cpu.emplace(std::move(*made));
  }
  if (voxels_) {
    if (Status ok = voxels_->use(*relighter); !ok) return ok;
  }
  gl_.emplace(std::move(*relighter));
  shading_ = std::move(shading);
  cpu_.reset();
  if (cpu) cpu_.emplace(std::move(*cpu));
  choice_ = choice;
  return done();
}

// The light over links that the state asks for.
Status Viewer::relight(const ViewState& state, const std::vector<Light>& lights, const std::vector<glm::mat4>& moved) {
  shadows_.setUniforms(gl_->gl()->surfelProgram());
  if (const GLuint program = gl_->gl()->movingProgram(); program != 0) shadows_.setUniforms(program);
  shadows_.bind();
  LightSetup setup;
  setup.emissionScale = glm::vec3(state.emission);
  Status lit = done();
  if (state.movingParts) {
    std::vector<glm::mat4> dynamic;
    for (const std::size_t k : dynamic_) dynamic.push_back(moved[k]);
    lit = parts_.emit(state);
    parts_.place(dynamic);
    parts_.addTo(setup);
  }
  setup.lights = lights;
  // Where what moves shines alone, the bake's materials are dark one by one, or as a whole where it knows none.
  const bool darkens = state.emission == 0.0f && setup.emissionScale != glm::vec3(0.0f);
  const std::vector<MaterialEmission> emissions = emissionsOf(bake_->emitters, state, !darkens);
  setup.materialEmissions = emissions;
  const std::vector<glm::vec3> darkness(darkens && emissions.empty() ? bake_->surfels.count() : 0, glm::vec3(0.0f));
  setup.surfelEmission = darkness;
  setup.skyRadiance = state.sky.radiance;
  if (state.sky.map && patchesRotation_ != state.sky.rotationDeg) {
    skyPatches_ = skyPatchesOf(state.sky, bake_->hierarchy.skyDirection.span());
    patchesRotation_ = state.sky.rotationDeg;
  }
  setup.skyPatches = skyPatches_;
  setup.bounceScale = state.bounceScale;
  // So many bounces and no more: so many frames from nothing.
  if (state.bounces > 0) relighter().reset();
  for (int frame = 0; frame < std::max(state.bounces, 1); ++frame) {
    if (Status ok = cpu_ ? cpu_->relight(setup, moved) : gl_->relight(setup); !ok) return ok;
  }
  if (cpu_) cpu_->upload(gl_->gl()->inputs());
  return lit;
}

// The voxels of a level with a bake, for cones, once they have been found.
Status Viewer::lightVoxels(const ViewState& state, const std::vector<Light>& lights,
                           const std::vector<glm::mat4>& moved) {
  if (!voxels_) {
    auto made = BakeOnGpu::create(*loaded_, state.live.cells, *gl_, options_.getProcAddress);
    if (!made) return made.error();
    voxels_ = std::move(*made);
  }
  const GlResolveInputs inputs = gl_->gl()->inputs();
  if (cpu_) cpu_->uploadNodes(inputs);
  return voxels_->update({inputs, lights, state}, moved, shadows_);
}

// What cones find for the view.
Status Viewer::followCones(const ViewState& state, const std::vector<glm::mat4>& moved, const LevelView& seen,
                           std::uint32_t width, std::uint32_t height) {
  const bool occlusion = state.mode == ViewMode::occlusion;
  if (!cones_ || cones_->isOfOcclusion() != occlusion) {
    cones_.reset();
    auto made = ViewCones::create(occlusion, live_ ? live_->getProcAddress() : options_.getProcAddress);
    if (!made) return made.error();
    cones_ = std::move(*made);
  }
  const auto drawn = [&](bool gloss) {
    level_.draw(seen, gloss);
    level_.drawDynamic(seen, moved, gloss);
  };
  const ConeView view{width, height, seen.clipFromWorld(), live_ ? live_->lit() : voxels_->number(), drawn};
  if (live_) return cones_->update(state, live_->volumes(), live_->sides(), view);
  const gl::LitSides* const sides = &voxels_->sides();
  return cones_->update(state, voxels_->volume(), {&sides, 1}, view);
}

}  // namespace relume
