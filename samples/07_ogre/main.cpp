// SPDX-License-Identifier: MIT
// A level in OGRE: its lights, its shadow textures and things that move, with Relume's indirect light.
//   ogre_level LEVEL_GAME.glb LEVEL.relume [--screenshot OUT.png] [--frames N] [--show all|direct|indirect] [--still]
// Without --screenshot in a window, until it is closed or for N frames; with it the last of N frames [60] as a file.
// --still: nothing moves. LEVEL_GAME.glb is what `relume bake LEVEL.glb -o LEVEL.relume --export-glb LEVEL_GAME.glb`
// wrote.
#include "scene.h"

#include <relume/bake_file.h>

#include <OgreCamera.h>
#include <OgreHardwarePixelBuffer.h>
#include <OgreLogManager.h>
#include <OgreRenderTexture.h>
#include <OgreRenderWindow.h>
#include <OgreRoot.h>
#include <OgreSceneManager.h>
#include <OgreTextureManager.h>
#include <OgreViewport.h>
#include <OgreWindowEventUtilities.h>

#include <glm/ext/matrix_transform.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <stb/stb_image_write.h>

namespace {

constexpr Ogre::uint kWidth = 640, kHeight = 360;

struct Arguments {
  std::string level, bake, picture;
  int frames = 0;  // 0: until the window is closed
  int show = 0;    // 0 all light, 1 direct, 2 indirect
  bool isStill = false;
};

bool parse(const std::vector<std::string>& given, Arguments& out) {
  const std::vector<std::string> shows{"all", "direct", "indirect"};
  if (given.size() < 2) return false;
  out.level = given[0];
  out.bake = given[1];
  for (std::size_t i = 2; i < given.size(); ++i) {
    if (given[i] == "--still") {
      out.isStill = true;
      continue;
    }
    if (i + 1 == given.size()) return false;
    const std::string& name = given[i];
    const std::string& value = given[++i];
    if (name == "--screenshot")
      out.picture = value;
    else if (name == "--frames" && std::atoi(value.c_str()) > 0)
      out.frames = std::atoi(value.c_str());
    else if (name == "--show" && std::find(shows.begin(), shows.end(), value) != shows.end())
      out.show = static_cast<int>(std::find(shows.begin(), shows.end(), value) - shows.begin());
    else
      return false;
  }
  if (!out.picture.empty() && out.frames == 0) out.frames = 60;
  return true;
}

relume::Status writePicture(Ogre::RenderTarget& target, const std::string& path) {
  std::vector<unsigned char> rgb(3ull * kWidth * kHeight);
  target.copyContentsToMemory(Ogre::Box(0, 0, kWidth, kHeight),
                              Ogre::PixelBox(kWidth, kHeight, 1, Ogre::PF_BYTE_RGB, rgb.data()));
  if (stbi_write_png(path.c_str(), kWidth, kHeight, 3, rgb.data(), 3 * kWidth) == 0)
    return relume::Error{relume::ErrorCode::io, path + " could not be written"};
  return relume::done();
}

relume::Status play(const Arguments& arguments, Ogre::Root& root, Ogre::RenderWindow& window) {
  relume::Result<Level> level = loadLevel(arguments.level);
  if (!level) return level.error();
  relume::Result<relume::Bake> bake = relume::mapBake(arguments.bake);
  if (!bake) return bake.error();
  if (level->bakeScene != bake->provenance.sceneHash)
    return relume::Error{relume::ErrorCode::invalidFile,
                         arguments.bake + " is not the bake that " + arguments.level + " was exported with"};
  if (bake->caches.grid.resolution.x == 0)
    std::fprintf(stderr, "%s: no grid, so that what moves gets no indirect light: bake without --grid-caches 0\n",
                 arguments.bake.c_str());
  relume::Result<RelumeLight> light = RelumeLight::create(*bake);
  if (!light) return light.error();
  Ogre::SceneManager& manager = *root.createSceneManager();
  relume::Result<Scene> scene = Scene::create(*level, *light, manager);
  if (!scene) return scene.error();
  light->addSurfels(*bake, manager, scene->camera(), Scene::surfelMaterial(), Scene::kSurfels);

  Ogre::RenderTarget* target = &window;
  if (!arguments.picture.empty()) {
    target = Ogre::TextureManager::getSingleton()
                 .createManual("picture", Ogre::RGN_DEFAULT, Ogre::TEX_TYPE_2D, kWidth, kHeight, 0, Ogre::PF_BYTE_RGBA,
                               Ogre::TU_RENDERTARGET)
                 ->getBuffer()
                 ->getRenderTarget();
  }
  Ogre::Viewport* const viewport = target->addViewport(&scene->camera());
  viewport->setVisibilityMask(Scene::kSolids);
  scene->camera().setAspectRatio(static_cast<float>(kWidth) / static_cast<float>(kHeight));
  scene->show(arguments.show);

  const auto start = std::chrono::steady_clock::now();
  for (int n = 0; (arguments.frames == 0 || n < arguments.frames) && !window.isClosed(); ++n) {
    OgreBites::WindowEventUtilities::messagePump();
    const std::chrono::duration<float> passed = std::chrono::steady_clock::now() - start;
    const float seconds = arguments.isStill      ? 0.0f
                          : arguments.frames > 0 ? static_cast<float>(n) / 30.0f
                                                 : passed.count();
    const glm::mat4 turned = glm::rotate(glm::mat4(1.0f), 0.3f * std::sin(0.4f * seconds), glm::vec3(0, 1, 0));
    scene->setSun(glm::mat3(turned) * level->sun.direction, level->sun.intensity);
    scene->setLamp(level->lamp.intensity * (0.8f + 0.2f * std::cos(2.3f * seconds)));
    scene->move(arguments.isStill ? -1.0f : seconds);
    // The frame, with the shadow textures that it needs; then light for the next one by the same
    root.renderOneFrame();
    if (relume::Status lit = light->update(); !lit) return lit;
  }
  double ms = 0.0;
  for (const relume::PassTime& pass : light->relighter().passTimes()) ms += pass.ms;
  std::printf("Relume's passes took %.2f ms in the last frame\n", ms);
  return arguments.picture.empty() ? relume::done() : writePicture(*target, arguments.picture);
}

relume::Status run(const Arguments& arguments) {
  Ogre::LogManager logs;
  logs.createLog("ogre", true, false, true);  // to nowhere
  Ogre::Root root("", "", "");
  try {  // exceptions belong to plugins, which end with `root`
    root.loadPlugin(OGRE_PLUGINS "/RenderSystem_GL3Plus");
    root.setRenderSystem(root.getAvailableRenderers().front());
    root.initialise(false);
    Ogre::NameValuePairList options;
    options["hidden"] = arguments.picture.empty() ? "false" : "true";
    Ogre::RenderWindow* const window = root.createRenderWindow("Relume in OGRE", kWidth, kHeight, false, &options);
    OgreBites::WindowEventUtilities::_addRenderWindow(window);
    // Programs that OGRE asks for as soon as there are shadows
    Ogre::ResourceGroupManager& resources = Ogre::ResourceGroupManager::getSingleton();
    resources.addResourceLocation(OGRE_MEDIA "/ShadowVolume", "FileSystem", Ogre::RGN_INTERNAL);
    resources.initialiseAllResourceGroups();
    return play(arguments, root, *window);
  } catch (const Ogre::Exception& e) {
    return relume::Error{relume::ErrorCode::unsupported, "OGRE: " + e.getDescription()};
  }
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  if (!parse({argv + 1, argv + argc}, arguments)) {
    std::fprintf(stderr,
                 "usage: ogre_level LEVEL_GAME.glb LEVEL.relume [--screenshot OUT.png] [--frames N] "
                 "[--show all|direct|indirect] [--still]\n");
    return 1;
  }
  const relume::Status played = run(arguments);
  if (played) return 0;
  std::fprintf(stderr, "ogre_level: %s\n", played.error().message.c_str());
  return relume::exitCode(played.error().code);
}
