// SPDX-License-Identifier: MIT
// See functions.h.
#include "runtime/gl/functions.h"

#include <charconv>
#include <string>
#include <string_view>

namespace relume::gl {
namespace {

// Whether a GL_VERSION like "4.3.0 vendor" is of OpenGL 4.least or newer. Those of OpenGL ES open with its name.
bool isOf(std::string_view text, unsigned least) {
  const char* const end = text.data() + text.size();
  unsigned major = 0, minor = 0;
  const auto afterMajor = std::from_chars(text.data(), end, major);
  if (afterMajor.ec != std::errc{} || afterMajor.ptr == end || *afterMajor.ptr != '.') return false;
  const auto afterMinor = std::from_chars(afterMajor.ptr + 1, end, minor);
  return afterMinor.ec == std::errc{} && (major > 4 || (major == 4 && minor >= least));
}

Error unsupported(std::string message) { return {ErrorCode::unsupported, std::move(message)}; }

// One function into its place; false when the host has none of that name.
template <class Pointer>
bool load(const GetProcAddress& getProcAddress, const char* name, Pointer& pointer) {
  pointer = reinterpret_cast<Pointer>(getProcAddress(name));
  return pointer != nullptr;
}

// Of a context that has all functions.
bool hasExtension(const Functions& gl, std::string_view name) {
  GLint count = 0;
  gl.GetIntegerv(GL_NUM_EXTENSIONS, &count);
  for (GLint i = 0; i < count; ++i) {
    const auto* text = reinterpret_cast<const char*>(gl.GetStringi(GL_EXTENSIONS, static_cast<GLuint>(i)));
    if (text != nullptr && text == name) return true;
  }
  return false;
}

Error missing(const char* name) {
  return unsupported("the OpenGL backend needs " + std::string(name) +
                     ", for which getProcAddress returned null: is an OpenGL 4.3 context current, and is this the "
                     "function that loads for it?");
}

}  // namespace

Result<Functions> loadFunctions(const GetProcAddress& getProcAddress) {
  if (!getProcAddress) {
    return Error{
        ErrorCode::usage,
        "the OpenGL backend needs RelightOptions::getProcAddress (in C: relume_relighter_desc.get_proc_address), "
        "which is empty: pass glfwGetProcAddress, SDL_GL_GetProcAddress, eglGetProcAddress or what else made "
        "the context"};
  }
  // The version first: of an older context some loaders give addresses that may not be called.
  Functions gl;
  if (!load(getProcAddress, "glGetString", gl.GetString)) return missing("glGetString");
  const auto* text = reinterpret_cast<const char*>(gl.GetString(GL_VERSION));
  if (text == nullptr || !isOf(text, 3)) {
    return unsupported("the OpenGL backend needs a current context of OpenGL 4.3 or newer, found " +
                       (text == nullptr ? std::string("none") : '"' + std::string(text) + '"'));
  }
#define RELUME_GL_LOAD(name, NAME) \
  if (!load(getProcAddress, "gl" #name, gl.name)) return missing("gl" #name);
  RELUME_GL_FUNCTIONS(RELUME_GL_LOAD)
#undef RELUME_GL_LOAD
  gl.hasQueryBuffer = isOf(text, 4) || hasExtension(gl, "GL_ARB_query_buffer_object");
  return gl;
}

Result<DrawFunctions> loadDrawFunctions(const GetProcAddress& getProcAddress, const Functions& gl) {
  DrawFunctions draw;
#define RELUME_GL_LOAD(name, NAME) \
  if (!load(getProcAddress, "gl" #name, draw.name)) return missing("gl" #name);
  RELUME_GL_DRAW_FUNCTIONS(RELUME_GL_LOAD)
#undef RELUME_GL_LOAD
  // Some loaders give an address of whatever is asked for.
  if (isOf(reinterpret_cast<const char*>(gl.GetString(GL_VERSION)), 5))
    load(getProcAddress, "glClipControl", draw.ClipControl);
  return draw;
}

}  // namespace relume::gl
