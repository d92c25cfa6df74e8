// SPDX-License-Identifier: MIT
// What both halves of relume.h's implementation keep: handles, their error texts, and the one place where failures of
// all kinds become a status.
#pragma once

#include "relume/bake_data.h"
#include "relume/relighter.h"
#include "relume/relume.h"
#include "relume/result.h"
#include "runtime/shared/memory.h"

#include <algorithm>
#include <cstring>
#include <exception>
#include <memory>
#include <memory_resource>
#include <mutex>
#include <new>
#include <string>
#include <utility>
#include <vector>

namespace relume::c {

// The callbacks for memory, or the global operators new and delete.
class HostMemory final : public std::pmr::memory_resource {
 public:
  // Both or neither of the callbacks.
  HostMemory(void* user, relume_allocate give, relume_deallocate takeBack)
      : user_(user), allocate_(give), deallocate_(takeBack) {}
  // Whether one gives back what the other gave.
  bool hasCallbacksOf(const HostMemory& other) const {
    return user_ == other.user_ && allocate_ == other.allocate_ && deallocate_ == other.deallocate_;
  }

 private:
  void* do_allocate(std::size_t bytes, std::size_t alignment) override {
    if (allocate_ == nullptr) return std::pmr::new_delete_resource()->allocate(bytes, alignment);
    void* const block = allocate_(user_, bytes, alignment);
    if (block == nullptr) throw RefusedMemory(bytes, alignment);
    return block;
  }
  void do_deallocate(void* block, std::size_t bytes, std::size_t alignment) override {
    if (deallocate_ == nullptr) return std::pmr::new_delete_resource()->deallocate(block, bytes, alignment);
    deallocate_(user_, block, bytes, alignment);
  }
  bool do_is_equal(const std::pmr::memory_resource& other) const noexcept override { return this == &other; }

  void* user_;
  relume_allocate allocate_;
  relume_deallocate deallocate_;
};

// What handles of a context share: its callbacks.
struct Host {
  void* user = nullptr;
  relume_log log = nullptr;
  relume_parallel_for parallelFor = nullptr;
  HostMemory memory;
};

// Serves the block of the Host itself, whose resource goes before its block does.
template <class T>
struct HostAllocator {
  using value_type = T;
  HostMemory memory;

  explicit HostAllocator(const HostMemory& callbacks) : memory(callbacks) {}
  template <class U>
  HostAllocator(const HostAllocator<U>& other) : memory(other.memory) {}
  T* allocate(std::size_t count) { return static_cast<T*>(memory.allocate(count * sizeof(T), alignof(T))); }
  void deallocate(T* block, std::size_t count) { memory.deallocate(block, count * sizeof(T), alignof(T)); }
  template <class U>
  bool operator==(const HostAllocator<U>& other) const {
    return memory.hasCallbacksOf(other.memory);
  }
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

// The host goes last of a handle: it gives the memory of all the rest.
struct Handle {
  explicit Handle(std::shared_ptr<Host> shared) : host(std::move(shared)) {}

  std::shared_ptr<Host> host;
  mutable LastError error;
};

// A handle's memory is the host's. Throws std::bad_alloc.
template <class T, class... Arguments>
Owned<T> makeHandle(const std::shared_ptr<Host>& host, Arguments&&... arguments) {
  return makeOwned<T>(&host->memory, host, std::forward<Arguments>(arguments)...);
}
template <class T>
void destroyHandle(T* handle) noexcept {
  if (handle == nullptr) return;
  const std::shared_ptr<Host> host = handle->host;
  handle->~T();
  host->memory.deallocate(handle, sizeof(T), alignof(T));
}

inline Error usage(std::string text) { return {ErrorCode::usage, std::move(text)}; }
inline Error nullPointer(const std::string& name) { return usage(name + " is null"); }

// A host's enumeration as a number: C may put any into one, and C++ may not read those that name none.
template <class E>
int numberOf(const E& value) {
  static_assert(sizeof(E) == sizeof(int));
  int number = 0;
  std::memcpy(&number, &value, sizeof number);
  return number;
}

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
  } catch (const std::bad_alloc& e) {
    return fail(*handle, RELUME_ERROR_MEMORY, outOfMemory(e).message.c_str());
  } catch (const std::exception& e) {
    return fail(*handle, RELUME_ERROR_FAILED, e.what());
  } catch (...) {
    return fail(*handle, RELUME_ERROR_FAILED, "an exception of the host's callbacks");
  }
}

// As run(), for a function that gives `*made`, which is null after every failure.
template <class T, class Work>
inline relume_status runToMake(const Handle* handle, T** made, const char* name, const Work& work) noexcept {
  if (made != nullptr) *made = nullptr;
  return run(handle, [&]() -> Status { return made == nullptr ? nullPointer(name) : work(); });
}

// The caller's struct over the defaults: fields that it does not have keep them. Its first member is struct_size.
template <class T>
Status readStruct(const T* from, std::size_t min, const char* name, T& to) {
  if (from == nullptr) return nullPointer(name);
  std::size_t size = 0;
  std::memcpy(&size, from, sizeof size);
  if (size < min) {
    return usage(std::string(name) + ".struct_size is " + std::to_string(size) + ", expected sizeof, at least " +
                 std::to_string(min));
  }
  std::memcpy(&to, from, std::min(size, sizeof(T)));
  return relume::done();
}

// Hand `filled` to a caller whose header may know less of the struct, or more.
template <class T>
Status fillStruct(T* info, T filled) {
  if (info == nullptr) return nullPointer("info");
  const std::size_t size = info->struct_size;
  if (size <= sizeof size) return usage("info.struct_size is " + std::to_string(size) + ", expected sizeof");
  filled.struct_size = size;
  std::memcpy(info, &filled, std::min(size, sizeof filled));
  return done();
}

}  // namespace relume::c

struct relume_context : relume::c::Handle {
  using Handle::Handle;
};
struct relume_bake : relume::c::Handle {
  relume_bake(std::shared_ptr<relume::c::Host> shared, relume::Bake loaded)
      : Handle(std::move(shared)), bake(std::move(loaded)) {}

  relume::Bake bake;
};
struct relume_moving_shapes : relume::c::Handle {
  relume_moving_shapes(std::shared_ptr<relume::c::Host> shared, relume::MovingShapes made)
      : Handle(std::move(shared)), shapes(std::move(made)) {}

  relume::MovingShapes shapes;
};
struct relume_relighter : relume::c::Handle {
  relume_relighter(std::shared_ptr<relume::c::Host> shared, relume::Relighter created, const relume::Bake& bake)
      : Handle(std::move(shared)),
        relighter(std::move(created)),
        lights(&host->memory),
        emissions(&host->memory),
        parts(&host->memory),
        surfels(bake.surfels.count()),
        skyPatches(bake.hierarchy.skyDirection.size()),
        caches(bake.caches.count()) {}

  relume::Relighter relighter;
  std::pmr::vector<relume::Light> lights;  // of the frame; these keep their memory
  std::pmr::vector<relume::MaterialEmission> emissions;
  std::pmr::vector<relume::MovingPart> parts;
  std::size_t surfels, skyPatches, caches;
};
