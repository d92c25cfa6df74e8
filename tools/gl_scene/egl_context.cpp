// SPDX-License-Identifier: MIT
// See egl_context.h.
#include "tools/gl_scene/egl_context.h"

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <array>
#include <cstring>
#include <vector>

namespace relume {

namespace {

// What the driver complained of.
struct DebugLog {
  int errors = 0;
  std::string last;
};

}  // namespace

struct EglContext::State {
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLContext context = EGL_NO_CONTEXT;
  DebugLog log;

  ~State() {
    if (display == EGL_NO_DISPLAY) return;
    if (context != EGL_NO_CONTEXT) {
      if (eglGetCurrentContext() == context) eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
      eglDestroyContext(display, context);
    }
  }
};

namespace {

// Whether a blank-separated extension list names `name` whole.
bool hasExtension(const char* list, const char* name) {
  const std::size_t length = std::strlen(name);
  for (const char* at = list; at && (at = std::strstr(at, name)); at += length) {
    const bool begins = at == list || at[-1] == ' ';
    const bool ends = at[length] == ' ' || at[length] == '\0';
    if (begins && ends) return true;
  }
  return false;
}

// Displays that need no window system, best first: hardware before software, wherever two vendors' drivers are.
std::vector<EGLDisplay> headlessDisplays() {
  std::vector<EGLDisplay> displays, software;
  const char* client = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  if (!hasExtension(client, "EGL_EXT_platform_base")) return displays;
  if (hasExtension(client, "EGL_EXT_platform_device") &&
      (hasExtension(client, "EGL_EXT_device_enumeration") || hasExtension(client, "EGL_EXT_device_base"))) {
    std::array<EGLDeviceEXT, 16> devices{};
    EGLint count = 0;
    if (!eglQueryDevicesEXT(static_cast<EGLint>(devices.size()), devices.data(), &count)) count = 0;
    const bool canTell = hasExtension(client, "EGL_EXT_device_query") || hasExtension(client, "EGL_EXT_device_base");
    for (EGLint i = 0; i < count; ++i) {
      EGLDeviceEXT device = devices[static_cast<std::size_t>(i)];
      const bool isSoftware =
          canTell && hasExtension(eglQueryDeviceStringEXT(device, EGL_EXTENSIONS), "EGL_MESA_device_software");
      (isSoftware ? software : displays).push_back(eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, device, nullptr));
    }
  }
  if (hasExtension(client, "EGL_MESA_platform_surfaceless"))
    displays.push_back(eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, nullptr, nullptr));
  displays.insert(displays.end(), software.begin(), software.end());
  return displays;
}

EGLContext createContext(EGLDisplay display, int major, int minor, bool debug) {
  const std::array<EGLint, 9> attributes = {EGL_CONTEXT_MAJOR_VERSION,
                                            major,
                                            EGL_CONTEXT_MINOR_VERSION,
                                            minor,
                                            EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                            EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                            EGL_CONTEXT_OPENGL_DEBUG,
                                            debug ? EGL_TRUE : EGL_FALSE,
                                            EGL_NONE};
  return eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes.data());
}

EGLContext createEsContext(EGLDisplay display) {
  const std::array<EGLint, 3> attributes = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_NONE};
  return eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes.data());
}

// Why a display gave no current context; empty when it did.
std::string tryDisplay(EGLDisplay display, const EglContext::Options& options, EGLContext& made) {
  if (display == EGL_NO_DISPLAY || !eglInitialize(display, nullptr, nullptr)) return "the display does not initialise";
  const char* extensions = eglQueryString(display, EGL_EXTENSIONS);
  if (!hasExtension(extensions, "EGL_KHR_no_config_context") &&
      !hasExtension(extensions, "EGL_MESA_configless_context")) {
    return "no contexts without a config";
  }
  if (!hasExtension(extensions, "EGL_KHR_surfaceless_context")) return "no contexts without a surface";
  if (!eglBindAPI(options.es ? EGL_OPENGL_ES_API : EGL_OPENGL_API))
    return options.es ? "no OpenGL ES" : "no desktop OpenGL";
  EGLContext context =
      options.es ? createEsContext(display) : createContext(display, options.major, options.minor, options.debug);
  if (context == EGL_NO_CONTEXT && !options.es) context = createContext(display, 4, 3, options.debug);
  if (context == EGL_NO_CONTEXT) return options.es ? "no OpenGL ES 3.0" : "no OpenGL 4.3 core profile";
  if (!eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) {
    eglDestroyContext(display, context);
    return "the context does not become current";
  }
  made = context;
  return {};
}

void GLAPIENTRY onDebugMessage(GLenum, GLenum type, GLuint, GLenum, GLsizei length, const GLchar* text,
                               const void* user) {
  if (type != GL_DEBUG_TYPE_ERROR && type != GL_DEBUG_TYPE_UNDEFINED_BEHAVIOR) return;
  auto* log = static_cast<DebugLog*>(const_cast<void*>(user));
  ++log->errors;
  log->last.assign(text, length >= 0 ? static_cast<std::size_t>(length) : std::strlen(text));
}

}  // namespace

Result<EglContext> EglContext::create(const Options& options) {
  if (!epoxy_has_egl()) return Error{ErrorCode::unsupported, "no headless OpenGL: libEGL is not installed"};
  auto state = std::make_unique<State>();
  std::string tried;
  for (EGLDisplay display : headlessDisplays()) {
    const std::string reason = tryDisplay(display, options, state->context);
    if (reason.empty()) {
      state->display = display;
      break;
    }
    tried += (tried.empty() ? "" : "; ") + reason;
  }
  if (state->context == EGL_NO_CONTEXT) {
    return Error{ErrorCode::unsupported,
                 "no headless OpenGL: expected EGL with a surfaceless or device platform, found " +
                     (tried.empty() ? std::string("neither") : tried)};
  }
  if (options.debug && !options.es) {
    glEnable(GL_DEBUG_OUTPUT);
    glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
    glDebugMessageCallback(onDebugMessage, &state->log);
  }
  return EglContext(std::move(state));
}

EglContext::EglContext(std::unique_ptr<State> state) : state_(std::move(state)) {}
EglContext::EglContext(EglContext&&) noexcept = default;
EglContext& EglContext::operator=(EglContext&&) noexcept = default;
EglContext::~EglContext() = default;

GlProc EglContext::getProcAddress(const char* name) { return eglGetProcAddress(name); }

std::string EglContext::renderer() const { return reinterpret_cast<const char*>(glGetString(GL_RENDERER)); }
std::string EglContext::version() const { return reinterpret_cast<const char*>(glGetString(GL_VERSION)); }

bool EglContext::makeCurrent() const {
  return eglMakeCurrent(state_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, state_->context) == EGL_TRUE;
}

int EglContext::errorCount() const { return state_->log.errors; }
const std::string& EglContext::lastError() const { return state_->log.last; }
void EglContext::forgetErrors() { state_->log = {}; }

}  // namespace relume
