// SPDX-License-Identifier: MIT
// See window.h. The only file that includes GLFW.
#include <epoxy/gl.h>

#include "tools/view/panel.h"
#include "tools/view/viewer.h"
#include "tools/view/window.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <cstdio>
#include <memory>

namespace relume {
namespace {

// GLFW from init to terminate, with one window.
class Window {
 public:
  Status open(const ViewerOptions& options) {
    glfwSetErrorCallback([](int, const char* text) { lastError() = text; });
    started_ = glfwInit() == GLFW_TRUE;
    if (!started_) return Error{ErrorCode::unsupported, "no display: " + lastError() + " (--headless needs none)"};
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    window_ =
        glfwCreateWindow(static_cast<int>(options.width), static_cast<int>(options.height), "Relume", nullptr, nullptr);
    if (!window_) return Error{ErrorCode::unsupported, "no window with OpenGL 4.3: " + lastError()};
    glfwMakeContextCurrent(window_);
    glfwSwapInterval(1);
    ImGui::CreateContext();
    ImGui::GetIO().IniFilename = nullptr;
    ImGui_ImplGlfw_InitForOpenGL(window_, true);
    ImGui_ImplOpenGL3_Init("#version 430");
    gui_ = true;
    return done();
  }
  ~Window() {
    if (gui_) {
      ImGui_ImplOpenGL3_Shutdown();
      ImGui_ImplGlfw_Shutdown();
      ImGui::DestroyContext();
    }
    if (window_) glfwDestroyWindow(window_);
    if (started_) glfwTerminate();
  }
  Window() = default;
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;
  GLFWwindow* get() const { return window_; }

 private:
  static std::string& lastError() {
    static std::string text;
    return text;
  }
  GLFWwindow* window_ = nullptr;
  bool started_ = false, gui_ = false;
};

// Keys and mouse move the camera while the panel does not want them.
void fly(GLFWwindow* window, FlyCamera& camera, float seconds, glm::dvec2& cursor) {
  glm::dvec2 now;
  glfwGetCursorPos(window, &now.x, &now.y);
  const glm::vec2 moved(now - cursor);
  cursor = now;
  const ImGuiIO& io = ImGui::GetIO();
  if (!io.WantCaptureMouse && glfwGetMouseButton(window, GLFW_MOUSE_BUTTON_RIGHT) == GLFW_PRESS)
    camera.turn(-0.004f * moved.x, -0.004f * moved.y);
  // While a number is typed, keys are its own.
  if (io.WantTextInput) return;
  const auto axis = [&](int plus, int minus) {
    return static_cast<float>((glfwGetKey(window, plus) == GLFW_PRESS) - (glfwGetKey(window, minus) == GLFW_PRESS));
  };
  const float speed = glfwGetKey(window, GLFW_KEY_LEFT_SHIFT) == GLFW_PRESS ? 8.0f : 2.0f;  // [m/s]
  camera.move(speed * seconds *
              glm::vec3(axis(GLFW_KEY_D, GLFW_KEY_A), axis(GLFW_KEY_E, GLFW_KEY_Q), axis(GLFW_KEY_W, GLFW_KEY_S)));
}

Status loop(GLFWwindow* window, const Scene& scene, const Bake& bake, Viewer& viewer, ViewState& state) {
  double last = glfwGetTime();
  glm::dvec2 cursor(0.0);
  glfwGetCursorPos(window, &cursor.x, &cursor.y);
  while (!glfwWindowShouldClose(window)) {
    glfwPollEvents();
    const double now = glfwGetTime();
    fly(window, state.camera, static_cast<float>(now - last), cursor);
    last = now;
    animate(state, now);
    ImGui_ImplOpenGL3_NewFrame();
    ImGui_ImplGlfw_NewFrame();
    ImGui::NewFrame();
    if (!ImGui::GetIO().WantTextInput && ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Tab), false))
      state.panel = !state.panel;
    drawPanel(scene, bake, viewer, state);
    int width = 0, height = 0;
    glfwGetFramebufferSize(window, &width, &height);
    if (width > 0 && height > 0) {
      if (Status ok =
              viewer.draw(state, 0, static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height), true);
          !ok)
        return ok;
    }
    ImGui::Render();
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
    glfwSwapBuffers(window);
  }
  return done();
}

}  // namespace

Status runWindow(const Scene& scene, const Bake& bake, const ViewerOptions& options) {
  auto state = initialState(scene, options);
  if (!state) return state.error();
  Window window;
  if (Status ok = window.open(options); !ok) return ok;
  if (epoxy_gl_version() < 43)
    return Error{ErrorCode::unsupported, "OpenGL 4.3 expected, " + std::to_string(epoxy_gl_version()) + " found"};
  auto viewer = Viewer::create(scene, bake, options, state->sky.map.get(), glfwGetProcAddress);
  if (!viewer) return viewer.error();
  std::printf("bands %s\n", viewer->bands().c_str());
  return loop(window.get(), scene, bake, *viewer, *state);
}

}  // namespace relume
