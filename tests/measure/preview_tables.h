// SPDX-License-Identifier: MIT
// What the parts of bench_preview share: levels with their rays and lights.
#pragma once

#include "bake/preview/hit_radiance.h"
#include "bake/rays/ray_tracer.h"
#include "bake/reference/emitters.h"
#include "bake/scene/sky.h"
#include "relume/bake/context.h"
#include "relume/bake/scene.h"

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace relume {

// A level under some of its lights: names separated by commas, `emissive` being its emitting surfaces.
struct LitLevel {
  Scene scene;
  std::optional<RayTracer> tracer;
  std::vector<SceneLight> lights;
  std::optional<EmittingTriangles> emitters;
  Sky sky;
  HitRadiance light;  // that is reflected once

  LitLevel(const std::string& path, const std::string& names, const std::vector<std::string>& without,
           Context& context) {
    auto imported = importGltf(path, context);
    if (!imported) stop(imported.error().message);
    scene = std::move(*imported);
    remove(without);
    auto made = RayTracer::create(scene, "", context, RayStructure::bundles);
    if (!made) stop(made.error().message);
    tracer.emplace(std::move(*made));
    const auto isOn = [&](const std::string& name) {
      return ("," + names + ",").find("," + name + ",") != std::string::npos;
    };
    for (const SceneLight& each : scene.lights) {
      if (isOn(each.name)) lights.push_back(each);
    }
    if (isOn("emissive")) emitters.emplace(scene, RayGeometry::fixed);
    if ((lights.empty() && !emitters) || scene.cameras.empty())
      stop(path + ": a camera and lights of those names expected");
    light = directRadiance(*tracer, *tracer, lights, emitters ? &*emitters : nullptr, sky, 1);
  }
  LitLevel(const LitLevel&) = delete;
  LitLevel& operator=(const LitLevel&) = delete;

  // The material of a name.
  Material& material(const std::string& name) {
    for (Material& each : scene.materials) {
      if (each.name == name) return each;
    }
    stop("no material " + name);
  }

  const Camera& camera(const std::string& name) const {
    for (const Camera& each : scene.cameras) {
      if (each.name == name) return each;
    }
    stop("no camera " + name);
  }

  [[noreturn]] static void stop(const std::string& message) {
    std::fprintf(stderr, "%s\n", message.c_str());
    std::exit(1);
  }

 private:
  // Take out what has one of these materials.
  void remove(const std::vector<std::string>& materials) {
    for (Instance& instance : scene.instances) {
      const std::uint32_t material = scene.meshes[instance.mesh].material;
      for (const std::string& name : materials) {
        if (material != kNone && scene.materials[material].name == name) instance.mode = BakeMode::ignore;
      }
    }
  }
};

// RCS Table 1 and Table 2: Markdown on standard output. `scenes`: folder of the levels, level/level.glb; `only`:
// one of them, or empty.
void printTable1(const std::string& scenes, std::size_t points, const std::string& only);
void printTable2(const std::string& scenes);
// RCS Fig. 9(b): a glossy back wall.
void printFigure9b(const std::string& scenes);

}  // namespace relume
