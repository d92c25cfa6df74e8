// SPDX-License-Identifier: MIT
// A level, its bake and one of its cameras, for programs that measure a view.
#pragma once

#include "bake/rays/ray_tracer.h"
#include "relume/bake/load_scene.h"
#include "relume/bake_file.h"

#include <algorithm>
#include <memory>
#include <string>
#include <utility>

namespace relume::test {

struct OpenedView {
  std::unique_ptr<Scene> scene;  // the tracer keeps its address
  RayTracer tracer;
  Bake bake;
  Camera camera;
};

// bakePath: empty = none.
inline Result<OpenedView> openView(const std::string& level, const std::string& bakePath, const std::string& camera,
                                   Context& context) {
  auto loaded = loadScene(level, context);
  if (!loaded) return loaded.error();
  auto scene = std::make_unique<Scene>(std::move(*loaded));
  auto tracer = RayTracer::create(*scene, "", context);
  if (!tracer) return tracer.error();
  auto bake = bakePath.empty() ? Result<Bake>(Bake{}) : readBake(bakePath);
  if (!bake) return bake.error();
  const auto seenBy =
      std::find_if(scene->cameras.begin(), scene->cameras.end(), [&](const Camera& c) { return c.name == camera; });
  if (seenBy == scene->cameras.end()) return Error{ErrorCode::usage, level + " has no camera \"" + camera + "\""};
  const Camera found = *seenBy;
  return OpenedView{std::move(scene), std::move(*tracer), std::move(*bake), found};
}

}  // namespace relume::test
