// SPDX-License-Identifier: MIT
// A game in small: a level, a character who walks through it, a lamp that flickers, a sun that turns, and indirect
// light that follows them.
//   embed LEVEL_GAME.glb LEVEL.relume       in a window: 1 all light, 2 direct, 3 indirect; space halts; Esc ends
//   embed LEVEL_GAME.glb LEVEL.relume OUT.png FRAMES [all|direct|indirect [still]]
//                                           the last of so many frames as a file; still: nothing moves, nobody walks
// LEVEL_GAME.glb is what `relume bake LEVEL.glb -o LEVEL.relume --export-glb LEVEL_GAME.glb` wrote.
#include "renderer.h"

#include <relume/bake_file.h>

#include <epoxy/gl.h>

#include <GLFW/glfw3.h>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <stb/stb_image_write.h>

namespace {

constexpr int kWidth = 960, kHeight = 540;

struct Arguments {
  std::string level, bake, picture;
  int frames = 0;  // 0: until the window is closed
  int show = 0;    // 0 all light, 1 direct, 2 indirect
  bool still = false;
};

// LEVEL BAKE [PICTURE FRAMES [all|direct|indirect [still]]]
bool parse(const std::vector<std::string>& given, Arguments& out) {
  const std::vector<std::string> shows{"all", "direct", "indirect"};
  if (given.size() < 2 || given.size() == 3 || given.size() > 6) return false;
  out.level = given[0];
  out.bake = given[1];
  if (given.size() == 2) return true;
  out.picture = given[2];
  out.frames = std::atoi(given[3].c_str());
  if (given.size() > 4) out.show = static_cast<int>(std::find(shows.begin(), shows.end(), given[4]) - shows.begin());
  out.still = given.size() > 5 && given[5] == "still";
  return out.frames > 0 && out.show < 3 && (given.size() < 6 || out.still);
}

// A figure of six boxes that walks around `middle`, `seconds` into the game.
std::vector<glm::mat4> figure(const glm::vec3& middle, float seconds) {
  const float angle = 0.5f * seconds, radius = 0.8f, swing = 0.5f * std::sin(6.0f * seconds);
  glm::mat4 feet =
      glm::translate(glm::mat4(1.0f), middle + radius * glm::vec3(std::cos(angle), 0.0f, -std::sin(angle)));
  feet = glm::rotate(feet, angle, {0, 1, 0});
  const auto box = [&](const glm::vec3& joint, float tilt, const glm::vec3& center, const glm::vec3& size) {
    const glm::mat4 limb = glm::rotate(glm::translate(feet, joint), tilt, {1, 0, 0});
    return glm::scale(glm::translate(limb, center), size);
  };
  return {box({0, 1.1f, 0}, 0, {0, 0, 0}, {0.36f, 0.55f, 0.2f}),                 // trunk
          box({0, 1.52f, 0}, 0, {0, 0, 0}, {0.2f, 0.24f, 0.2f}),                 // head
          box({-0.1f, 0.82f, 0}, swing, {0, -0.41f, 0}, {0.14f, 0.82f, 0.16f}),  // legs
          box({0.1f, 0.82f, 0}, -swing, {0, -0.41f, 0}, {0.14f, 0.82f, 0.16f}),
          box({-0.24f, 1.35f, 0}, -swing, {0, -0.3f, 0}, {0.1f, 0.6f, 0.12f}),  // arms
          box({0.24f, 1.35f, 0}, swing, {0, -0.3f, 0}, {0.1f, 0.6f, 0.12f})};
}

int fail(const relume::Error& error) {
  std::fprintf(stderr, "embed: %s\n", error.message.c_str());
  return relume::exitCode(error.code);
}

int play(const Arguments& arguments, GLFWwindow* window) {
  relume::Result<Level> level = loadLevel(arguments.level);
  if (!level) return fail(level.error());
  const Draw cube = appendCube(*level);
  relume::Result<relume::Bake> bake = relume::mapBake(arguments.bake);
  if (!bake) return fail(bake.error());
  if (level->bakeScene != bake->provenance.sceneHash)
    return fail({relume::ErrorCode::invalidFile,
                 arguments.bake + " is not the bake that " + arguments.level + " was exported with"});
  if (bake->caches.grid.resolution.x == 0)
    std::fprintf(stderr, "%s: no grid, so that the cube gets no indirect light: bake without --grid-caches 0\n",
                 arguments.bake.c_str());
  relume::Result<Renderer> renderer = Renderer::create(*level, cube, *bake, kWidth, kHeight, glfwGetProcAddress);
  if (!renderer) return fail(renderer.error());

  Frame frame;
  frame.worldFromCamera = level->worldFromCamera;
  frame.fovYRad = level->fovYRad;
  frame.sun = level->sun;
  frame.lamp = level->lamp;
  frame.show = arguments.show;
  // The character walks in front of the camera, on the floor below it.
  const glm::vec3 ahead = glm::vec3(level->worldFromCamera * glm::vec4(0, 0, -3.0f, 1));
  const glm::vec3 walk(ahead.x, 0.0f, ahead.z);
  float seconds = 0.0f;
  double last = glfwGetTime();
  for (int n = 0; arguments.frames > 0 ? n < arguments.frames : !glfwWindowShouldClose(window); ++n) {
    glfwPollEvents();
    const double now = glfwGetTime();
    const bool halted = arguments.still || glfwGetKey(window, GLFW_KEY_SPACE) == GLFW_PRESS;
    if (!halted) seconds += arguments.frames > 0 ? 1.0f / 30.0f : static_cast<float>(now - last);
    last = now;
    for (int k = 0; k < 3; ++k) {
      if (glfwGetKey(window, GLFW_KEY_1 + k) == GLFW_PRESS) frame.show = k;
    }
    if (glfwGetKey(window, GLFW_KEY_ESCAPE) == GLFW_PRESS) glfwSetWindowShouldClose(window, GLFW_TRUE);
    frame.lamp.intensity = level->lamp.intensity * (0.8f + 0.2f * std::cos(2.3f * seconds));
    const glm::mat4 turned = glm::rotate(glm::mat4(1.0f), 0.3f * std::sin(0.4f * seconds), glm::vec3(0, 1, 0));
    frame.sun.direction = glm::mat3(turned) * level->sun.direction;
    frame.boxes = arguments.still ? std::vector<glm::mat4>() : figure(walk, seconds);
    if (relume::Status drawn = renderer->draw(frame); !drawn) return fail(drawn.error());
    int width = 0, height = 0;
    glfwGetFramebufferSize(window, &width, &height);
    renderer->present(width, height);
    glfwSwapBuffers(window);
  }
  double ms = 0.0;
  for (const relume::PassTime& pass : renderer->relighter().passTimes()) ms += pass.ms;
  std::printf("Relume's passes took %.2f ms in the last frame\n", ms);
  stbi_flip_vertically_on_write(1);
  if (!arguments.picture.empty() &&
      stbi_write_png(arguments.picture.c_str(), kWidth, kHeight, 3, renderer->picture().data(), 3 * kWidth) == 0)
    return fail({relume::ErrorCode::io, arguments.picture + " could not be written"});
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  if (!parse({argv + 1, argv + argc}, arguments)) {
    std::fprintf(stderr, "usage: embed LEVEL_GAME.glb LEVEL.relume [OUT.png FRAMES [all|direct|indirect [still]]]\n");
    return 1;
  }
  if (glfwInit() == GLFW_FALSE) return fail({relume::ErrorCode::unsupported, "no display to open a window on"});
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 5);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_VISIBLE, arguments.frames == 0);
  GLFWwindow* const window = glfwCreateWindow(kWidth, kHeight, "embed", nullptr, nullptr);
  if (window == nullptr) return fail({relume::ErrorCode::unsupported, "no OpenGL 4.5"});
  glfwMakeContextCurrent(window);
  glfwSwapInterval(arguments.frames == 0 ? 1 : 0);
  const int status = play(arguments, window);
  glfwTerminate();
  return status;
}
