// SPDX-License-Identifier: MIT
// See counting_loader.h.
#include "tests/runtime/counting_loader.h"

#include "runtime/gl/functions.h"
#include "tools/gl_scene/egl_context.h"

#include <array>

namespace relume::test {
namespace {

// Places of the functions in the table.
#define RELUME_GL_PLACE(name, NAME) k##name,
enum Place : std::size_t { RELUME_GL_FUNCTIONS(RELUME_GL_PLACE) kPlaces };
#undef RELUME_GL_PLACE

#define RELUME_GL_NAME(name, NAME) "gl" #name,
constexpr std::array<std::string_view, kPlaces> kNames = {RELUME_GL_FUNCTIONS(RELUME_GL_NAME)};
#undef RELUME_GL_NAME

std::array<std::array<int, kPlaces>, 2> counts{};

// One function of one loader.
template <int kLoader, Place kPlace, class Pointer>
struct Counted;
template <int kLoader, Place kPlace, class Result, class... Arguments>
struct Counted<kLoader, kPlace, Result(APIENTRYP)(Arguments...)> {
  static inline Result(APIENTRYP original)(Arguments...) = nullptr;

  static Result APIENTRY call(Arguments... arguments) {
    ++counts[kLoader][kPlace];
    return original(arguments...);
  }
  static GlProc wrap(GlProc egl) {
    original = reinterpret_cast<Result(APIENTRYP)(Arguments...)>(egl);
    return egl == nullptr ? nullptr : reinterpret_cast<GlProc>(&call);
  }
};

template <int kLoader>
GlProc load(const char* name) {
#define RELUME_GL_WRAP(function, NAME) \
  if (name == kNames[k##function])     \
    return Counted<kLoader, k##function, PFNGL##NAME##PROC>::wrap(EglContext::getProcAddress(name));
  RELUME_GL_FUNCTIONS(RELUME_GL_WRAP)
#undef RELUME_GL_WRAP
  return nullptr;
}

}  // namespace

GetProcAddress countingLoader(int loader) { return loader == 0 ? load<0> : load<1>; }

int calls(int loader, std::string_view prefix) {
  int sum = 0;
  for (std::size_t i = 0; i < kPlaces; ++i) {
    if (kNames[i].starts_with(prefix)) sum += counts[static_cast<std::size_t>(loader)][i];
  }
  return sum;
}

void forgetCalls(int loader) { counts[static_cast<std::size_t>(loader)].fill(0); }

int objectsMade(int loader) {
  return calls(loader, "glGen") + calls(loader, "glCreate") + calls(loader, "glFenceSync");
}
int objectsDeleted(int loader) { return calls(loader, "glDelete"); }

}  // namespace relume::test
