// SPDX-License-Identifier: MIT
// Pictures and films of what the window shows, without panel and handles: numbered PNG files that never replace one.
#pragma once

#include "relume/result.h"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

namespace relume {

class Capture {
 public:
  // Frames of a film are so far apart in time [s], however long each takes to draw.
  static constexpr double kFrameSeconds = 1.0 / 30.0;

  explicit Capture(std::filesystem::path folder) : folder_(std::move(folder)) {}

  // The framebuffer that is bound, as relume_0001.png or the next number that is free. Returns its path. io: not
  // writable.
  Result<std::filesystem::path> screenshot(std::uint32_t width, std::uint32_t height) const;

  // A film is a folder film_0001 with frame_0000.png and so on. io: it cannot be made.
  Status beginFilm();
  bool isFilming() const { return film_.has_value(); }
  // One more frame of it. An error ends the film; what is there stays. failed: the window has another size.
  Status frame(std::uint32_t width, std::uint32_t height);
  std::uint32_t frames() const { return frames_; }
  // The folder of the film that ends.
  std::filesystem::path endFilm();

 private:
  std::filesystem::path folder_;
  std::optional<std::filesystem::path> film_;
  std::uint32_t frames_ = 0, width_ = 0, height_ = 0;
};

}  // namespace relume
