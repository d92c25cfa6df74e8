// SPDX-License-Identifier: MIT
// Radiance records splatted in OpenGL 4.3 (RCS 4.2): what the pixels show as textures, the records in buffers, each
// drawn as the box of its sphere of influence and added up by blending; then a pass that divides by the weights.
//
// As RecordTiles has it, at every pixel: boxes, weights, gradients and the order of sums are the same. No call but
// create() makes an OpenGL object; storage grows with the records and the picture. What calls bind and set is put back
// (saved_drawing.h, runtime/gl/saved_state.h). The context that was current in create() is current in every other call,
// and when it dies.
#pragma once

#include "bake/preview/draw_splats.h"
#include "relume/relighter.h"
#include "relume/result.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace relume {

struct SplatsGlOptions {
  GetProcAddress getProcAddress;  // of the context that is current
  // For shaders that read between the picture's pixels: light() is of RGBA32UI, reflected light and the sky's together
  // as floats, in w the pixel's normal as packSnorm4x8 has it and 127 where there is light. read() has nothing then.
  bool packed = false;
  std::uint32_t maxRecords = 10000000;  // [1..10000000]
};

class SplatsGl final : public SplatDrawer {
 public:
  // usage: getProcAddress is empty, maxRecords out of its range; unsupported: no OpenGL 4.3, or one that does not add
  // up 32-bit floats in a target; failed: a shader's log.
  static Result<std::unique_ptr<SplatsGl>> create(const SplatsGlOptions& options);
  SplatsGl(const SplatsGl&) = delete;
  SplatsGl& operator=(const SplatsGl&) = delete;
  ~SplatsGl() override;

  // unsupported: a picture beyond what this OpenGL draws into, more records than maxRecords; memory: of the GPU. usage:
  // receivers that are not one a pixel, a draw() before look(), an add() or relight() before draw(), a relight() of
  // another number of records, a read() of a packed picture or into another number of pixels.
  [[nodiscard]] Status look(const CameraRays& camera, std::span<const PixelReceiver> receivers) override;
  [[nodiscard]] Status draw(std::span<const Record> records, const Interpolation& options) override;
  [[nodiscard]] Status add(std::span<const Record> records) override;
  [[nodiscard]] Status relight(std::span<const Record> records) override;
  // Waits for the GPU.
  [[nodiscard]] Status read(std::span<Splat> picture) override;

  // Textures, of the OpenGL that made them, of the size of the last look(), row 0 the picture's first. Light: packed,
  // or RGBA32F of reflected irradiance [W/m²] and the sum of weights. Place: RGBA32F, position and width of a pixel
  // [m].
  std::uint32_t light() const;
  std::uint32_t place() const;
  // Bytes that the last call has sent to OpenGL.
  std::size_t sentBytes() const;
  // Bytes of buffers and textures.
  std::size_t sizeBytes() const;

 private:
  struct State;
  explicit SplatsGl(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace relume
