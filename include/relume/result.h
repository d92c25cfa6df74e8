// SPDX-License-Identifier: MIT
// What a room's door returns: a value, or an Error that says what went wrong, where, and what to do about it.
// No exception crosses a public function of this project; exceptions of third-party packages end in the .cpp that
// calls the package.
#pragma once

#include <cassert>
#include <string>
#include <utility>
#include <variant>

#ifdef Status
#error \
    "Xlib has made Status a macro: include Relume's headers before <X11/Xlib.h>, <GL/glx.h> and <EGL/egl.h>, or #undef Status"
#endif

namespace relume {

// The kind of failure; exitCode() maps it to the exit status of the command line.
enum class ErrorCode {
  usage,        // an option or argument is out of its range
  io,           // a file could not be read or written
  invalidFile,  // a file was read and is not what it claims to be
  failed,       // the work itself failed (also: cancelled by the caller)
  unsupported,  // valid, but nothing we can handle (unknown required extension, newer version, no OpenGL)
  memory,       // memory ran out, the host's (std::pmr::memory_resource) or the system's
};

struct Error {
  ErrorCode code = ErrorCode::failed;
  std::string message;  // names file, chunk, node or triangle; says what was expected and what was found
};

// Exit status of the command line for an error. 0 is success and 7 is "difference found".
constexpr int exitCode(ErrorCode code) {
  switch (code) {
    case ErrorCode::usage:
      return 1;
    case ErrorCode::io:
      return 2;
    case ErrorCode::invalidFile:
      return 3;
    case ErrorCode::failed:
    case ErrorCode::memory:
      return 4;
    case ErrorCode::unsupported:
      return 5;
  }
  return 4;
}

// A T or an Error. Test it before taking the value:
//   Result<Bake> bake = readBake(path);
//   if (!bake) return bake.error();
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}
  Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}

  explicit operator bool() const { return state_.index() == 0; }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T&& operator*() && { return std::move(value()); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }
  T& value() {
    assert(state_.index() == 0);
    return *std::get_if<0>(&state_);
  }
  const T& value() const {
    assert(state_.index() == 0);
    return *std::get_if<0>(&state_);
  }
  Error& error() {
    assert(state_.index() == 1);
    return *std::get_if<1>(&state_);
  }
  const Error& error() const {
    assert(state_.index() == 1);
    return *std::get_if<1>(&state_);
  }

 private:
  std::variant<T, Error> state_;
};

struct Nothing {};

// The result of work that yields no value: `return done();` or an Error.
using Status = Result<Nothing>;
inline Status done() { return Nothing{}; }

}  // namespace relume
