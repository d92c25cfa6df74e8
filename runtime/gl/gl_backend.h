// SPDX-License-Identifier: MIT
// The OpenGL backend: runs the plan of a frame's passes (runtime/passes/frame_plan.h), and reads back.
#pragma once

#include "runtime/backend.h"
#include "runtime/gl/check_textures.h"
#include "runtime/gl/functions.h"
#include "runtime/gl/plan_objects.h"
#include "runtime/gl/timer.h"
#include "runtime/passes/frame_plan.h"

#include <memory>
#include <optional>
#include <string>

namespace relume::gl {

class GlBackend final : public Backend, public GlResolve {
 public:
  // The bake must pass checkBake(); its arrays are kept. gl: of the context that is current, here and in every other
  // call. unsupported: buffers too large; failed: a shader's log. images: declared, by drivable material. texture: of
  // the grid, may be empty. movingParts, movingLag: RelightOptions. wanted: what work groups are to suit; nothing = the
  // driver that runs here. memory: keeps all of this.
  static Result<Owned<GlBackend>> create(const Functions& gl, const Bake& bake, const CacheBands& bands,
                                         std::string_view visibilityGlsl, const ImageSizes& images, GridTexture texture,
                                         std::pmr::memory_resource* memory, std::uint32_t movingParts = 0,
                                         std::uint32_t movingLag = 1, std::optional<gpu::GroupThreads> wanted = {});
  // What create() begins with: nothing is on the GPU yet.
  GlBackend(const Functions& gl, const Bake& bake, const CacheBands& bands, const ImageSizes& images,
            GridTexture texture, Owned<gpu::FramePlan> plan, std::pmr::memory_resource* memory)
      : memory_(memory),
        gl_(gl),
        bake_(bake),
        bands_(bands),
        imageSizes_(images, memory),
        texture_(std::move(texture)),
        plan_(std::move(plan)),
        objects_(gl_, *plan_, memory),
        timer_(gl_),
        coefficients_(memory),
        texels_(memory) {}

  Status checkTextures(const LightSetup& setup) const override {
    if (Status ok = plan_->checkShapes(setup); !ok) return ok;
    if (Status ok = plan_->checkHost(setup); !ok) return ok;
    return gl::checkTextures(gl_, setup, imageSizes_);
  }
  void reserve(const LightSetup& setup) override;
  void relight(const LightSetup& setup) override;
  void reset() override;
  CacheLight light() const override { return {bands_, coefficients()}; }
  // [W/m²/sr] [Size n_C * CacheBands::stride()] of the last frame, valid until the next one.
  std::span<const float> coefficients() const;
  const GridTexture* gridTexture() const override { return texture_.empty() ? nullptr : &texture_; }
  std::span<const float> gridTexels() const override;
  std::vector<glm::vec3> nodeRadiosity() const override;
  std::vector<PassTime> passTimes() const override;
  std::vector<std::pair<std::string, std::size_t>> bufferSizes() const override;
  const GlResolve* gl() const override { return this; }

  GlResolveInputs inputs() const override;
  const std::string& glsl() const override { return resolveGlsl_; }
  void bind() const override;
  std::uint32_t surfelProgram() const override { return objects_.program("light_surfels.comp"); }
  std::uint32_t movingProgram() const override { return objects_.program("light_parts.comp"); }
  const std::string& surfelGlsl() const override { return surfelGlsl_; }
  std::uint32_t surfelSlots() const override { return plan_->surfelSlots(); }
  void bindSurfels() const override;

 private:
  // Passes of the timer: those of GpuPass from surfels on.
  static constexpr std::size_t kTimed = 5;
  // All of a plan's frame. mark: whether its passes are timed.
  void run(const GpuFrame& frame, bool mark);
  // Vectors, chroma or open cells of the grid's texture; 0 = none.
  GLuint gridImage(std::uint32_t number) const;

  std::pmr::memory_resource* memory_;
  Functions gl_;  // before all that deletes by it
  Bake bake_;     // shares the arrays
  CacheBands bands_;
  ImageSizes imageSizes_;  // of the images that were declared
  GridTexture texture_;
  Owned<gpu::FramePlan> plan_;
  mutable PlanObjects objects_;  // makes the buffer for the host's light when it is first bound
  std::string resolveGlsl_, surfelGlsl_;
  mutable FrameTimer<kTimed> timer_;
  mutable std::pmr::vector<float> coefficients_;  // read back
  mutable bool readBack_ = false;                 // whether coefficients_ are this frame's
  mutable std::pmr::vector<float> texels_;        // likewise those of the grid's texture
  mutable bool texelsReadBack_ = false;
};

}  // namespace relume::gl
