// SPDX-License-Identifier: MIT
// Writes into buffers in the order of all else that is done with them. A driver was seen to do BufferSubData() before a
// clear of the same bytes, or another write to them, that was asked for earlier (docs/notes/gpu.md, "On hardware");
// copies from another buffer are commands like all others.
#pragma once

#include "runtime/gl/handle.h"

#include <cstddef>
#include <span>

namespace relume::gl {

class HostWrites {
 public:
  explicit HostWrites(const Functions& gl) : gl_(&gl) {}
  // Makes an object, if it has none yet.
  void prepare();
  void write(const Buffer& buffer, std::size_t begin, std::span<const std::byte> data);

 private:
  const Functions* gl_;
  Handle<detail::deleteBuffer> staging_;  // empty between writes
};

}  // namespace relume::gl
