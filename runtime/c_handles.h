// SPDX-License-Identifier: MIT
// What both halves of relume.h's implementation keep: handles, their error texts, and the one place where failures of
// all kinds become a status.
#pragma once

#include "relume/bake_data.h"
#include "relume/relighter.h"
#include "relume/relume.h"
#include "relume/result.h"

#include <algorithm>
#include <cstring>
#include <exception>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace relume::c {

// What handles of a context share: its callbacks.
struct Host {
  void* user = nullptr;
  relume_log log = nullptr;
  relume_parallel_for parallelFor = nullptr;
};

// The last failure's text. Const functions of one handle may fail on several threads at once.
class LastError {
 public:
  void set(std::string text) {
    const std::lock_guard lock(mutex_);
    text_ = std::move(text);
  }
  const char* text() const {
    const std::lock_guard lock(mutex_);
    return text_.c_str();
  }

 private:
  mutable std::mutex mutex_;
  std::string text_;
};

struct Handle {
  std::shared_ptr<const Host> host;
  mutable LastError error;
};

inline relume_status statusOf(ErrorCode code) {
  switch (code) {
    case ErrorCode::usage:
      return RELUME_ERROR_USAGE;
    case ErrorCode::io:
      return RELUME_ERROR_IO;
    case ErrorCode::invalidFile:
      return RELUME_ERROR_INVALID_FILE;
    case ErrorCode::failed:
      return RELUME_ERROR_FAILED;
    case ErrorCode::unsupported:
      return RELUME_ERROR_UNSUPPORTED;
    case ErrorCode::memory:
      return RELUME_ERROR_MEMORY;
  }
  return RELUME_ERROR_FAILED;
}

inline relume_status fail(const Handle& handle, relume_status status, const char* text) noexcept {
  try {
    handle.error.set(text);
    if (handle.host->log != nullptr) handle.host->log(handle.host->user, RELUME_ERROR, text);
  } catch (...) {  // no memory for the text, or a log that throws: the status has to do
  }
  return status;
}

// Runs work() -> Status for a function that was called with `handle`; every failure ends as a status and a text.
template <class Work>
inline relume_status run(const Handle* handle, const Work& work) noexcept {
  if (handle == nullptr) return RELUME_ERROR_USAGE;
  try {
    const Status status = work();
    return status ? RELUME_OK : fail(*handle, statusOf(status.error().code), status.error().message.c_str());
  } catch (const std::bad_alloc&) {
    return fail(*handle, RELUME_ERROR_MEMORY, "memory ran out");
  } catch (const std::exception& e) {
    return fail(*handle, RELUME_ERROR_FAILED, e.what());
  } catch (...) {
    return fail(*handle, RELUME_ERROR_FAILED, "an exception of the host's callbacks");
  }
}

inline Error usage(std::string text) { return {ErrorCode::usage, std::move(text)}; }
inline Error nullPointer(const char* name) { return usage(std::string(name) + " is null"); }

// The caller's struct over the defaults: fields that it does not have keep them. Its first member is struct_size.
template <class T>
Status readStruct(const T* from, std::size_t least, const char* name, T& to) {
  if (from == nullptr) return nullPointer(name);
  std::size_t size = 0;
  std::memcpy(&size, from, sizeof size);
  if (size < least) {
    return usage(std::string(name) + ".struct_size is " + std::to_string(size) + ", expected sizeof, at least " +
                 std::to_string(least));
  }
  std::memcpy(&to, from, std::min(size, sizeof(T)));
  return relume::done();
}

}  // namespace relume::c

struct relume_context : relume::c::Handle {};
struct relume_bake : relume::c::Handle {
  relume::Bake bake;
};
struct relume_relighter : relume::c::Handle {
  std::optional<relume::Relighter> relighter;
  std::vector<relume::Light> lights;  // of the frame; keeps its memory
  std::size_t surfels = 0, skyPatches = 0;
};
