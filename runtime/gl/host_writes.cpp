// SPDX-License-Identifier: MIT
// See host_writes.h.
#include "runtime/gl/host_writes.h"

namespace relume::gl {

void HostWrites::prepare() {
  if (staging_.get() != 0) return;
  GLuint name = 0;
  gl_->GenBuffers(1, &name);
  staging_ = Handle<detail::deleteBuffer>(*gl_, name);
}

void HostWrites::write(const Buffer& buffer, std::size_t begin, std::span<const std::byte> data) {
  if (data.empty()) return;
  prepare();
  const auto bytes = static_cast<GLsizeiptr>(data.size());
  gl_->BindBuffer(GL_COPY_READ_BUFFER, staging_.get());
  gl_->BufferData(GL_COPY_READ_BUFFER, bytes, data.data(), GL_STREAM_DRAW);
  gl_->BindBuffer(GL_COPY_WRITE_BUFFER, buffer.get());
  gl_->CopyBufferSubData(GL_COPY_READ_BUFFER, GL_COPY_WRITE_BUFFER, 0, static_cast<GLintptr>(begin), bytes);
  gl_->BufferData(GL_COPY_READ_BUFFER, 0, nullptr, GL_STREAM_DRAW);
}

}  // namespace relume::gl
