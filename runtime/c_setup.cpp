// SPDX-License-Identifier: MIT
// See c_setup.h.
#include "runtime/c_setup.h"

#include <functional>
#include <string>

namespace relume::c {

Status readBackend(const relume_backend& from, BackendKind& to) {
  const int backend = numberOf(from);
  if (backend != RELUME_BACKEND_CPU && backend != RELUME_BACKEND_GL)
    return usage("desc.backend is " + std::to_string(backend) + ", expected CPU 0 or GL 1");
  to = backend == RELUME_BACKEND_GL ? BackendKind::gl : BackendKind::cpu;
  return done();
}

ParallelFor parallelForOf(const Host& context) {
  if (context.parallelFor == nullptr) return {};
  return [host = &context](std::uint32_t tasks, const std::function<void(std::uint32_t)>& body) {
    const relume_task task = [](void* data, unsigned int index) {
      (*static_cast<const std::function<void(std::uint32_t)>*>(data))(index);
    };
    host->parallelFor(host->user, tasks, task, const_cast<std::function<void(std::uint32_t)>*>(&body));
  };
}

Status readLights(const relume_light_setup& read, std::pmr::vector<Light>& lights) {
  if (read.lights == nullptr && read.light_count > 0) return nullPointer("setup.lights");
  lights.clear();
  for (std::size_t i = 0; i < read.light_count; ++i) {
    const relume_light& from = read.lights[i];
    const int kind = numberOf(from.kind);
    if (kind < RELUME_DIRECTIONAL || kind > RELUME_SPOT) {
      return usage("light setup: lights[" + std::to_string(i) + "].kind is " + std::to_string(kind) +
                   ", expected directional 0, point 1 or spot 2");
    }
    Light light;
    light.kind = static_cast<LightKind>(kind);
    light.intensity = vec3(from.intensity);
    light.positionWorld = vec3(from.position);
    light.direction = vec3(from.direction);
    light.range = from.range;
    light.innerConeRad = from.inner_cone_radians;
    light.outerConeRad = from.outer_cone_radians;
    lights.push_back(light);
  }
  return done();
}

VisibilityBatch visibilityOf(const relume_light_setup& setup) {
  if (setup.visibility == nullptr) return {};
  // One pointer: std::function allocates nothing for it.
  return [host = &setup](std::uint32_t light, std::span<const glm::vec3> position, std::span<const glm::vec3> normal,
                         std::span<float> visible) {
    host->visibility(host->visibility_user, light, static_cast<unsigned int>(position.size()), &position[0].x,
                     &normal[0].x, visible.data());
  };
}

}  // namespace relume::c
