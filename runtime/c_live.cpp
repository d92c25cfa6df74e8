// SPDX-License-Identifier: MIT
// relume_live.h over the C++ API: light without a bake.
#include "relume/live_light.h"
#include "runtime/c_setup.h"

#include <algorithm>
#include <cstring>
#include <span>
#include <string>
#include <vector>

struct relume_live : relume::c::Handle {
  relume_live(std::shared_ptr<relume::c::Host> shared, relume::LiveLight created)
      : Handle(std::move(shared)), light(std::move(created)), lights(&host->memory) {}

  relume::LiveLight light;
  std::pmr::vector<relume::Light> lights;  // of the frame; these keep their memory
};

namespace {

using relume::Result;
using relume::Status;
using namespace relume::c;

static_assert(sizeof(glm::mat4x3) == 12 * sizeof(float) && sizeof(glm::uvec3) == 3 * sizeof(unsigned int));

// What a description hands over, as the C++ API takes it. The arrays stay the host's.
struct Geometry {
  std::vector<relume::VoxelSurface> surfaces;
  std::vector<relume::VoxelMesh> meshes;
  std::vector<relume::VoxelPart> parts;

  relume::VoxelGeometry view() const { return {surfaces, meshes, parts}; }
};

Status readGeometry(const relume_live_desc& desc, Geometry& geometry) {
  if (desc.surfaces == nullptr && desc.surface_count > 0) return nullPointer("desc.surfaces");
  if (desc.meshes == nullptr && desc.mesh_count > 0) return nullPointer("desc.meshes");
  if (desc.parts == nullptr && desc.part_count > 0) return nullPointer("desc.parts");
  for (std::size_t i = 0; i < desc.surface_count; ++i) {
    const relume_live_surface& from = desc.surfaces[i];
    geometry.surfaces.push_back({vec3(from.albedo), vec3(from.emission), from.coverage, from.double_sided != 0});
  }
  for (std::size_t i = 0; i < desc.mesh_count; ++i) {
    const relume_live_mesh& from = desc.meshes[i];
    const std::string name = "desc.meshes[" + std::to_string(i) + "].";
    if (from.positions == nullptr && from.position_count > 0) return nullPointer(name + "positions");
    if (from.triangles == nullptr && from.triangle_count > 0) return nullPointer(name + "triangles");
    if (from.surfaces == nullptr && from.triangle_count > 0) return nullPointer(name + "surfaces");
    geometry.meshes.push_back({vectors(from.positions, from.position_count),
                               {reinterpret_cast<const glm::uvec3*>(from.triangles), from.triangle_count},
                               {from.surfaces, from.triangle_count}});
  }
  for (std::size_t i = 0; i < desc.part_count; ++i) {
    const relume_live_part& from = desc.parts[i];
    geometry.parts.push_back({from.mesh, transform(from.to_world), from.moves != 0});
  }
  return relume::done();
}

}  // namespace

relume_status relume_live_create(relume_context* context, const relume_live_desc* desc, relume_live** live) {
  return runToMake(context, live, "live", [&]() -> Status {
    relume_live_desc read{};
    if (Status ok = readStruct(desc, sizeof read.struct_size + 1, "desc", read); !ok) return ok;
    relume::LiveLightOptions options;
    if (Status ok = readBackend(read.backend, options.backend); !ok) return ok;
    Geometry geometry;
    if (Status ok = readGeometry(read, geometry); !ok) return ok;
    options.boxMin = vec3(read.box_min);
    options.boxMax = vec3(read.box_max);
    if (read.cells != 0) options.cells = read.cells;
    if (read.rays_per_cell != 0) options.raysPerCell = read.rays_per_cell;
    options.surfaceBudget = read.surface_budget;
    if (read.cascades != 0) options.cascades = read.cascades;
    options.boxFollowsEye = read.box_follows_eye != 0;
    if (read.eye != nullptr) options.eyeWorld = vec3(read.eye);
    if (read.gl_prefix != nullptr) options.glNames.prefix = read.gl_prefix;
    if (read.gl_texture_units != nullptr) std::copy_n(read.gl_texture_units, 3, options.glNames.textureUnits.begin());
    options.parallelFor = parallelForOf(*context->host);
    if (read.visibility_glsl != nullptr) options.visibilityGlsl = read.visibility_glsl;
    if (read.get_proc_address != nullptr) {
      options.getProcAddress = [&read](const char* name) {
        return read.get_proc_address(read.get_proc_address_user, name);
      };
    }
    Result<relume::LiveLight> created = relume::LiveLight::create(geometry.view(), options);
    if (!created) return created.error();
    *live = makeHandle<relume_live>(context->host, std::move(*created)).release();
    return relume::done();
  });
}
void relume_live_destroy(relume_live* live) { destroyHandle(live); }
const char* relume_live_error(const relume_live* live) { return live == nullptr ? "" : live->error.text(); }

relume_status relume_live_move(relume_live* live, const float* to_world, size_t count) {
  return run(live, [&]() -> Status {
    if (to_world == nullptr && count > 0) return nullPointer("to_world");
    return live->light.move({reinterpret_cast<const glm::mat4x3*>(to_world), count});
  });
}

relume_status relume_live_edit_parts(relume_live* live, const relume_live_edit* edits, size_t count) {
  return run(live, [&]() -> Status {
    if (edits == nullptr && count > 0) return nullPointer("edits");
    std::vector<relume::PartEdit> read;
    for (std::size_t i = 0; i < count; ++i)
      read.push_back({edits[i].part, transform(edits[i].to_world), edits[i].present != 0});
    return live->light.edit(read);
  });
}

relume_status relume_live_centre(relume_live* live, const float* eye, int* moved) {
  return run(live, [&]() -> Status {
    if (eye == nullptr) return nullPointer("eye");
    const Result<bool> found = live->light.centre(vec3(eye));
    if (!found) return found.error();
    if (moved != nullptr) *moved = *found ? 1 : 0;
    return relume::done();
  });
}

void relume_live_frame_default(relume_live_frame* frame, size_t struct_size) {
  if (frame == nullptr || struct_size < sizeof frame->struct_size) return;
  // Of the host's header, which may be older or newer: no byte beyond its struct is written.
  relume_live_frame whole{};
  whole.struct_size = struct_size;
  for (float& channel : whole.emission_scale) channel = 1.0f;
  whole.bounce_scale = 1.0f;
  std::memset(frame, 0, struct_size);
  std::memcpy(frame, &whole, std::min(struct_size, sizeof whole));
}

relume_status relume_live_update(relume_live* live, const relume_light_setup* setup, const relume_live_frame* frame) {
  return run(live, [&]() -> Status {
    relume_light_setup read;
    relume_light_setup_default(&read, sizeof read);
    if (Status ok = readStruct(setup, sizeof read.struct_size + 1, "setup", read); !ok) return ok;
    relume_live_frame how;
    relume_live_frame_default(&how, sizeof how);
    if (frame != nullptr) {
      if (Status ok = readStruct(frame, sizeof how.struct_size + 1, "frame", how); !ok) return ok;
    }
    if (how.sky_map != nullptr && how.sky_side == 0)
      return relume::Error{relume::ErrorCode::usage,
                           "frame: sky_map is given and sky_side is 0: texels along its side"};
    if (Status ok = readLights(read, live->lights); !ok) return ok;
    relume::LightSetup lit;
    lit.lights = live->lights;
    lit.visibilityBatch = visibilityOf(read);
    relume::LiveFrame next;
    next.emissionScale = vec3(how.emission_scale);
    next.bounceScale = how.bounce_scale;
    next.keep = how.keep;
    next.sky.radiance = vec3(how.sky_radiance);
    next.sky.map = vectors(how.sky_map, std::size_t{how.sky_side} * how.sky_side);
    next.sky.side = how.sky_map == nullptr ? 0 : how.sky_side;
    next.raySet = how.ray_set;
    next.freezeVoxels = how.freeze_voxels != 0;
    return live->light.update(lit, next);
  });
}

relume_status relume_live_reset(relume_live* live) {
  return run(live, [&]() -> Status {
    live->light.reset();
    return relume::done();
  });
}

relume_status relume_live_irradiance(const relume_live* live, size_t count, const float* positions,
                                     const float* normals, float* irradiance) {
  return run(live, [&]() -> Status {
    if (count == 0) return relume::done();
    if (positions == nullptr) return nullPointer("positions");
    if (normals == nullptr) return nullPointer("normals");
    if (irradiance == nullptr) return nullPointer("irradiance");
    const auto found = vectors(irradiance, count);
    for (std::size_t i = 0; i < count; ++i)
      found[i] = live->light.irradiance(vec3(positions + 3 * i), vec3(normals + 3 * i));
    return relume::done();
  });
}

relume_status relume_live_get_info(const relume_live* live, relume_live_info* info) {
  return run(live, [&]() -> Status {
    const relume::VoxelStats voxels = live->light.voxels();
    return fillStruct(info, {0, voxels.occupied, voxels.dropped, live->light.caches()});
  });
}

const char* relume_live_gl_glsl(const relume_live* live) {
  return live == nullptr || live->light.gl() == nullptr ? nullptr : live->light.gl()->glsl().c_str();
}

relume_status relume_live_gl_bind(const relume_live* live, unsigned int program) {
  return run(live, [&]() -> Status {
    if (live->light.gl() == nullptr) return usage("the light is not of RELUME_BACKEND_GL");
    if (Status ok = live->light.gl()->setUniforms(program); !ok) return ok;
    live->light.gl()->bind();
    return relume::done();
  });
}

unsigned int relume_live_gl_direct_program(const relume_live* live) {
  return live == nullptr || live->light.gl() == nullptr ? 0 : live->light.gl()->directProgram();
}
