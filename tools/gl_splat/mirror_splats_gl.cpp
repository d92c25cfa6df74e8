// SPDX-License-Identifier: MIT
// See mirror_splats_gl.h.
#include "tools/gl_splat/mirror_splats_gl.h"

#include "bake/preview/glossy_lobe.h"
#include "bake/preview/hsh.h"
#include "bake/preview/hsh_cells.h"
#include "runtime/gl/program.h"
#include "runtime/gl/saved_state.h"
#include "shaders/shared/layout.h"
#include "tools/gl_splat/saved_drawing.h"
#include "tools/gl_splat/splat_targets.h"

#include <glm/mat3x3.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace relume {
namespace {

using MirrorWords = std::array<glm::vec4, RELUME_SPLAT_MIRROR_LIGHTS>;
constexpr std::size_t kMaxMirrorRecords = 1u << 24;  // whose number a float holds

}  // namespace

struct MirrorSplatsGl::State {
  State(const gl::Functions& functions, const gl::DrawFunctions& drawing)
      : targets(functions, drawing, std::vector<GLenum>{GL_RGBA32F}) {}
  Status make();
  Status check(const CameraRays& camera, std::span<const PixelReceiver> receivers,
               std::span<const MirrorSurface> surfaces, std::span<const Record> records,
               const RadianceRecords& radiance, std::span<const MirrorSplat> picture) const;
  void store(GLuint slot, const gl::Buffer& buffer, std::span<const float> values);

  gl::SplatTargets targets;
  int order = 0;
  GLint64 largest = 0;  // [byte] of a storage buffer
  gl::Program splat, show;
  gl::Texture lobe;
  gl::Buffer shapeBuffer, frameBuffer, radianceBuffer, tiltBuffer, lobeBuffer;
  std::vector<gl::SplatShape> shapes;
  std::vector<MirrorWords> frames;
};

Status MirrorSplatsGl::State::make() {
  GLint blocks = 0;
  targets.gl.GetIntegerv(GL_MAX_FRAGMENT_SHADER_STORAGE_BLOCKS, &blocks);
  if (blocks < 3)
    return gl::splatUnsupported("this OpenGL's fragment shaders read " + std::to_string(blocks) +
                                " storage buffers, mirrors need 3");
  targets.gl.GetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &largest);
  const std::array<std::pair<std::string, std::string>, 1> defines{{{"RELUME_SPLAT_ORDER", std::to_string(order)}}};
  auto made = gl::makeDrawProgram(targets.gl, "splat_records.vert", "splat_mirrors.frag", defines);
  if (!made) return made.error();
  splat = std::move(*made);
  made = gl::makeDrawProgram(targets.gl, "splat_picture.vert", "splat_picture.frag", defines);
  if (!made) return made.error();
  show = std::move(*made);
  lobe = targets.makeTexture();
  for (gl::Buffer* buffer : {&shapeBuffer, &frameBuffer, &radianceBuffer, &tiltBuffer, &lobeBuffer})
    *buffer = targets.makeBuffer();
  targets.make(shapeBuffer, frameBuffer, sizeof(MirrorWords));
  return done();
}

Status MirrorSplatsGl::State::check(const CameraRays& camera, std::span<const PixelReceiver> receivers,
                                    std::span<const MirrorSurface> surfaces, std::span<const Record> records,
                                    const RadianceRecords& radiance, std::span<const MirrorSplat> picture) const {
  const auto pixels = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  for (const std::size_t found : {receivers.size(), surfaces.size(), picture.size()}) {
    if (found != pixels)
      return gl::splatUsage("mirrors of " + std::to_string(found) + " pixels, expected the camera's " +
                            std::to_string(pixels));
  }
  if (radiance.order() != order)
    return gl::splatUsage("mirrors by records of order " + std::to_string(radiance.order()) + ", expected " +
                          std::to_string(order));
  if (radiance.frames().size() != records.size() ||
      radiance.coefficients().size() != records.size() * hshRecordSize(order))
    return gl::splatUsage(std::to_string(records.size()) + " records, and radiance of " +
                          std::to_string(radiance.frames().size()));
  const std::size_t bytes = radiance.coefficients().size_bytes();
  if (records.size() > kMaxMirrorRecords || bytes > static_cast<std::size_t>(std::max<GLint64>(largest, 0)) ||
      radiance.coefficients().size() > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max()))
    return gl::splatUnsupported(std::to_string(records.size()) + " radiance records of order " + std::to_string(order) +
                                ", " + std::to_string(bytes) + " bytes; this OpenGL's storage buffers hold " +
                                std::to_string(largest));
  return done();
}

void MirrorSplatsGl::State::store(GLuint slot, const gl::Buffer& buffer, std::span<const float> values) {
  targets.gl.BindBuffer(GL_COPY_WRITE_BUFFER, buffer.get());
  targets.gl.BufferData(GL_COPY_WRITE_BUFFER, static_cast<GLsizeiptr>(values.size_bytes()), values.data(),
                        GL_DYNAMIC_DRAW);
  targets.gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, slot, buffer.get());
}

Result<std::unique_ptr<MirrorSplatsGl>> MirrorSplatsGl::create(const GetProcAddress& getProcAddress, int order) {
  if (order < 1 || order > kMaxHshOrder)
    return gl::splatUsage("the order of mirrors must be 1..10, found " + std::to_string(order));
  const auto functions = gl::loadFunctions(getProcAddress);
  if (!functions) return functions.error();
  const auto drawing = gl::loadDrawFunctions(getProcAddress, *functions);
  if (!drawing) return drawing.error();
  const gl::SavedState saved(*functions);
  const gl::SavedDrawing savedDrawing(*functions, *drawing);
  auto state = std::make_unique<State>(*functions, *drawing);
  state->order = order;
  if (Status ok = state->make(); !ok) return ok.error();
  return std::unique_ptr<MirrorSplatsGl>(new MirrorSplatsGl(std::move(state)));
}

MirrorSplatsGl::MirrorSplatsGl(std::unique_ptr<State> state) : state_(std::move(state)) {}
MirrorSplatsGl::~MirrorSplatsGl() = default;

Status MirrorSplatsGl::draw(const CameraRays& camera, std::span<const PixelReceiver> receivers,
                            std::span<const MirrorSurface> surfaces, std::span<const Record> records,
                            const RadianceRecords& radiance, const Interpolation& options,
                            std::span<MirrorSplat> picture) {
  State& s = *state_;
  if (Status ok = s.check(camera, receivers, surfaces, records, radiance, picture); !ok) return ok;
  const gl::SavedState saved(s.targets.gl);
  const gl::SavedDrawing drawing(s.targets.gl, s.targets.draw);

  // 1. The pixels and their lobes
  if (Status ok = s.targets.setSize(camera); !ok) return ok;
  s.targets.sendPixels(receivers);
  s.targets.send(s.lobe, surfaces.size(),
                 [&](std::size_t i) { return glm::vec4(surfaces[i].axis, surfaces[i].exponent); });

  // 2. The records
  s.shapes.clear();
  s.frames.clear();
  for (std::size_t k = 0; k < records.size(); ++k) {
    const glm::mat3& frame = radiance.frames()[k];
    s.shapes.push_back(gl::splatShapeOf(camera, records[k], options));
    s.frames.push_back({glm::vec4(frame[0], static_cast<float>(k)), glm::vec4(frame[1], 0.0f)});
  }
  s.targets.clearPicture();
  s.targets.clearSums();
  if (!records.empty()) {
    s.targets.sendBuffer(s.shapeBuffer, s.shapes, 0, s.shapes.size());
    s.targets.sendBuffer(s.frameBuffer, s.frames, 0, s.frames.size());
    s.store(RELUME_SPLAT_SLOT_RADIANCE, s.radianceBuffer, radiance.coefficients());
    s.store(RELUME_SPLAT_SLOT_TILTS, s.tiltBuffer, radiance.tilt().tables());
    s.store(RELUME_SPLAT_SLOT_LOBES, s.lobeBuffer, radiance.lobes().coefficients());
    if (Status ok = s.targets.takeError(std::to_string(records.size()) + " radiance records"); !ok) return ok;

    // 3. Their sums, and the picture
    s.targets.beginSums(s.splat.get(), options, true);
    s.targets.gl.ProgramUniform1i(s.splat.get(), RELUME_SPLAT_AT_MAX_TILT, radiance.tilt().maxDeg());
    s.targets.bind(RELUME_SPLAT_UNIT_LOBE, s.lobe);
    s.targets.drawRecords(0, s.shapes.size());
    s.targets.show(s.show.get());
  }
  const std::span<const glm::vec4> texels = s.targets.read(s.targets.picture[0]);
  for (std::size_t i = 0; i < picture.size(); ++i) picture[i] = {glm::vec3(texels[i]), texels[i].w};
  return s.targets.takeError("mirrors of " + gl::splatSizeText(s.targets.width, s.targets.height) + " pixels");
}

}  // namespace relume
