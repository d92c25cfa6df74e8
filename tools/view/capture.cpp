// SPDX-License-Identifier: MIT
// See capture.h.
#include <epoxy/gl.h>

#include "tools/images/image_io.h"
#include "tools/view/capture.h"

#include <algorithm>
#include <cstdio>
#include <string>
#include <system_error>
#include <utility>

namespace relume {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxNumber = 9999;

std::string numbered(const char* format, unsigned number) {
  char name[32];
  std::snprintf(name, sizeof name, format, number);
  return name;
}

// The first of the numbers at which nothing is, not even a link that leads nowhere.
Result<fs::path> freePath(const fs::path& folder, const char* format) {
  for (int i = 1; i <= kMaxNumber; ++i) {
    const fs::path path = folder / numbered(format, static_cast<unsigned>(i));
    std::error_code failed;
    if (fs::symlink_status(path, failed).type() == fs::file_type::not_found) return path;
    if (failed) return Error{ErrorCode::io, "\"" + path.string() + "\": " + failed.message()};
  }
  return Error{ErrorCode::io, "\"" + (folder / numbered(format, kMaxNumber)).string() +
                                  "\": all numbers are taken; choose another folder with -o"};
}

Status makeFolder(const fs::path& folder) {
  std::error_code failed;
  fs::create_directories(folder, failed);
  if (failed) return Error{ErrorCode::io, "cannot make folder \"" + folder.string() + "\": " + failed.message()};
  return done();
}

// What the bound framebuffer shows, row 0 on top.
std::vector<std::uint8_t> pixelsOf(std::uint32_t width, std::uint32_t height) {
  const std::size_t row = std::size_t{3} * width;
  std::vector<std::uint8_t> upward(row * height), pixels(upward.size());
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, static_cast<GLsizei>(width), static_cast<GLsizei>(height), GL_RGB, GL_UNSIGNED_BYTE,
               upward.data());
  glPixelStorei(GL_PACK_ALIGNMENT, 4);
  for (std::size_t y = 0; y < height; ++y)
    std::copy_n(upward.begin() + static_cast<std::ptrdiff_t>((height - 1 - y) * row), row,
                pixels.begin() + static_cast<std::ptrdiff_t>(y * row));
  return pixels;
}

}  // namespace

Result<fs::path> Capture::screenshot(std::uint32_t width, std::uint32_t height) const {
  if (Status ok = makeFolder(folder_); !ok) return ok.error();
  const Result<fs::path> path = freePath(folder_, "relume_%04u.png");
  if (!path) return path.error();
  if (Status ok = writePng(*path, width, height, pixelsOf(width, height)); !ok) return ok.error();
  return path;
}

Status Capture::beginFilm() {
  if (Status ok = makeFolder(folder_); !ok) return ok;
  const Result<fs::path> path = freePath(folder_, "film_%04u");
  if (!path) return path.error();
  if (Status ok = makeFolder(*path); !ok) return ok;
  film_ = *path;
  frames_ = width_ = height_ = 0;
  return done();
}

Status Capture::frame(std::uint32_t width, std::uint32_t height) {
  if (!film_) return done();
  if (frames_ == 0) {
    width_ = width;
    height_ = height;
  }
  if (width != width_ || height != height_) {
    const std::string folder = endFilm().string();
    return Error{ErrorCode::failed, "the window's size has changed, which ends the film in \"" + folder + "\""};
  }
  const Status written = writePng(*film_ / numbered("frame_%04u.png", frames_), width, height, pixelsOf(width, height));
  if (!written) {
    endFilm();
    return written;
  }
  ++frames_;
  return done();
}

fs::path Capture::endFilm() {
  const fs::path ended = film_.value_or(fs::path());
  film_.reset();
  return ended;
}

}  // namespace relume
