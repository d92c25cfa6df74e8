// SPDX-License-Identifier: MIT
// relume.h over the C++ API: relighters and their light.
#include "runtime/c_handles.h"
#include "runtime/c_setup.h"

#include <algorithm>
#include <cstring>
#include <functional>
#include <span>

namespace {

using relume::Owned;
using relume::Result;
using relume::Status;
using namespace relume::c;

static_assert(sizeof(glm::vec2) == 2 * sizeof(float));

// The parts of a frame, in place of those that were there. Numbers are the relighter's to check.
Status readParts(const relume_light_setup& read, std::pmr::vector<relume::MovingPart>& parts) {
  if (read.moving_parts == nullptr && read.moving_part_count > 0) return nullPointer("setup.moving_parts");
  if (read.moving_part_count > relume::kMaxMovingParts)
    return usage("setup.moving_part_count is " + std::to_string(read.moving_part_count) + ", expected at most " +
                 std::to_string(relume::kMaxMovingParts));
  parts.clear();
  for (std::size_t i = 0; i < read.moving_part_count; ++i)
    parts.push_back({read.moving_parts[i].shape, transform(read.moving_parts[i].to_world)});
  return relume::done();
}

std::span<const glm::vec2> points(const float* v, std::size_t count) {
  return {reinterpret_cast<const glm::vec2*>(v), count};
}

}  // namespace

// ---- Relighters

relume_status relume_relighter_create(relume_bake* bake, const relume_relighter_desc* desc,
                                      relume_relighter** relighter) {
  return runToMake(bake, relighter, "relighter", [&]() -> Status {
    relume_relighter_desc read{};
    if (desc != nullptr) {
      if (Status ok = readStruct(desc, sizeof read.struct_size + 1, "desc", read); !ok) return ok;
    }
    relume::RelightOptions options;
    if (Status ok = readBackend(read.backend, options.backend); !ok) return ok;
    options.lumaBands = read.luma_bands;
    options.chromaBands = read.chroma_bands;
    options.glossy = read.glossy != 0;
    options.gridTexture = read.grid_texture != 0;
    if (read.grid_trust != 0.0f) options.gridTrust = read.grid_trust;
    if (read.grid_texture_bytes != 0) options.gridTextureBytes = read.grid_texture_bytes;
    options.movingParts = read.moving_parts;
    if (read.moving_lag != 0) options.movingLag = read.moving_lag;
    options.parallelFor = parallelForOf(*bake->host);
    if (read.visibility_glsl != nullptr) options.visibilityGlsl = read.visibility_glsl;
    if (read.get_proc_address != nullptr) {
      options.getProcAddress = [&read](const char* name) {
        return read.get_proc_address(read.get_proc_address_user, name);
      };
    }
    if (read.driven_images == nullptr && read.driven_image_count > 0) return nullPointer("desc.driven_images");
    for (std::size_t i = 0; i < read.driven_image_count; ++i) {
      const relume_driven_image& image = read.driven_images[i];
      if (image.material == nullptr) return nullPointer("desc.driven_images[" + std::to_string(i) + "].material");
      options.drivenImages.push_back({image.material, image.width, image.height});
    }
    options.memory = &bake->host->memory;
    Result<relume::Relighter> created = relume::Relighter::create(bake->bake, options);
    if (!created) return created.error();
    Owned<relume_relighter> made = makeHandle<relume_relighter>(bake->host, std::move(*created), bake->bake);
    made->parts.reserve(options.movingParts);
    *relighter = made.release();
    return relume::done();
  });
}
void relume_relighter_destroy(relume_relighter* relighter) { destroyHandle(relighter); }
const char* relume_relighter_error(const relume_relighter* relighter) {
  return relighter == nullptr ? "" : relighter->error.text();
}

void relume_light_setup_default(relume_light_setup* setup, size_t struct_size) {
  if (setup == nullptr || struct_size < sizeof setup->struct_size) return;
  // Of the host's header, which may be older or newer: no byte beyond its struct is written.
  relume_light_setup whole{};
  whole.struct_size = struct_size;
  for (float& channel : whole.emission_scale) channel = 1.0f;
  whole.bounce_scale = 1.0f;
  std::memset(setup, 0, struct_size);
  std::memcpy(setup, &whole, std::min(struct_size, sizeof whole));
}

relume_status relume_relight(relume_relighter* relighter, const relume_light_setup* setup) {
  return run(relighter, [&]() -> Status {
    relume_light_setup read;
    relume_light_setup_default(&read, sizeof read);
    if (Status ok = readStruct(setup, sizeof read.struct_size + 1, "setup", read); !ok) return ok;
    if (Status ok = readLights(read, relighter->lights); !ok) return ok;
    if (read.material_emissions == nullptr && read.material_emission_count > 0)
      return nullPointer("setup.material_emissions");
    relighter->emissions.clear();
    for (std::size_t i = 0; i < read.material_emission_count; ++i) {
      const relume_material_emission& from = read.material_emissions[i];
      if (from.image == nullptr && from.texel_count > 0)
        return nullPointer("setup.material_emissions[" + std::to_string(i) + "].image");
      if (from.image != nullptr && from.texel_count == 0)
        return usage("setup.material_emissions[" + std::to_string(i) +
                     "].texel_count is 0, expected width * height of the image");
      relighter->emissions.push_back(
          {from.material, vec3(from.radiance), vectors(from.image, from.texel_count), from.texture});
    }
    relume::LightSetup frame;
    if (Status ok = readParts(read, relighter->parts); !ok) return ok;
    frame.movingParts = relighter->parts;
    frame.movingShapes = read.moving_shapes == nullptr ? nullptr : &read.moving_shapes->shapes;
    frame.lights = relighter->lights;
    frame.materialEmissions = relighter->emissions;
    frame.visibilityBatch = visibilityOf(read);
    frame.surfelIrradiance = vectors(read.surfel_irradiance, relighter->surfels);
    frame.surfelEmission = vectors(read.surfel_emission, relighter->surfels);
    frame.skyPatches = vectors(read.sky_patches, relighter->skyPatches);
    frame.skyRadiance = vec3(read.sky_radiance);
    frame.emissionScale = vec3(read.emission_scale);
    frame.bounceScale = read.bounce_scale;
    return relighter->relighter.relight(frame);
  });
}

relume_status relume_reset(relume_relighter* relighter) {
  return run(relighter, [&]() -> Status {
    relighter->relighter.reset();
    return relume::done();
  });
}

relume_status relume_inherit(relume_relighter* relighter, const relume_bake* bake, const relume_relighter* previous) {
  return run(relighter, [&]() -> Status {
    if (bake == nullptr) return nullPointer("bake");
    if (previous == nullptr) return nullPointer("previous");
    return relighter->relighter.inherit(previous->relighter, bake->bake);
  });
}

// ---- Light

relume_status relume_irradiance_on_lightmap(const relume_relighter* relighter, size_t count, const float* uvs,
                                            const float* normals, const float* geometric_normals, float* irradiance) {
  return run(relighter, [&]() -> Status {
    if (count == 0) return relume::done();
    if (uvs == nullptr) return nullPointer("uvs");
    if (normals == nullptr) return nullPointer("normals");
    if (irradiance == nullptr) return nullPointer("irradiance");
    const float* planes = geometric_normals != nullptr ? geometric_normals : normals;
    return relighter->relighter.irradianceOnLightmap(points(uvs, count), vectors(normals, count),
                                                     vectors(planes, count), vectors(irradiance, count));
  });
}

relume_status relume_irradiance_in_grid(const relume_relighter* relighter, size_t count, const float* positions,
                                        const float* normals, float* irradiance) {
  return relume_irradiance_in_grid_by(relighter, RELUME_GRID_STENCIL, count, positions, normals, irradiance);
}

relume_status relume_irradiance_in_grid_by(const relume_relighter* relighter, relume_grid_lookup lookup, size_t count,
                                           const float* positions, const float* normals, float* irradiance) {
  return run(relighter, [&]() -> Status {
    const int kind = numberOf(lookup);
    if (kind < 0 || kind > RELUME_GRID_SMOOTH)
      return usage("lookup is " + std::to_string(kind) + ", expected 0 to " + std::to_string(RELUME_GRID_SMOOTH));
    if (count == 0) return relume::done();
    if (positions == nullptr) return nullPointer("positions");
    if (normals == nullptr) return nullPointer("normals");
    if (irradiance == nullptr) return nullPointer("irradiance");
    return relighter->relighter.irradianceInGrid(vectors(positions, count), vectors(normals, count),
                                                 vectors(irradiance, count), static_cast<relume::GridLookup>(kind));
  });
}

relume_status relume_grid_texture_get_info(const relume_relighter* relighter, relume_grid_texture_info* info) {
  return run(relighter, [&]() -> Status {
    const relume::GridTextureInfo texture = relighter->relighter.gridTexture();
    relume_grid_texture_info out{};
    for (int k = 0; k < 3; ++k) {
      out.resolution[k] = texture.resolution[k];
      out.origin[k] = texture.originWorld[k];
      out.spacing[k] = texture.spacing[k];
    }
    out.cells = static_cast<unsigned int>(texture.cells);
    out.open_cells = static_cast<unsigned int>(texture.openCells);
    return fillStruct(info, out);
  });
}

relume_status relume_glossy_on_lightmap(const relume_relighter* relighter, size_t count, const float* uvs,
                                        const float* reflected, const float* exponents, float* radiance) {
  return run(relighter, [&]() -> Status {
    if (count == 0) return relume::done();
    if (uvs == nullptr) return nullPointer("uvs");
    if (reflected == nullptr) return nullPointer("reflected");
    if (exponents == nullptr) return nullPointer("exponents");
    if (radiance == nullptr) return nullPointer("radiance");
    return relighter->relighter.glossyOnLightmap(points(uvs, count), vectors(reflected, count), {exponents, count},
                                                 vectors(radiance, count));
  });
}

relume_status relume_glossy_in_grid(const relume_relighter* relighter, size_t count, const float* positions,
                                    const float* normals, const float* reflected, const float* exponents,
                                    float* radiance) {
  return run(relighter, [&]() -> Status {
    if (count == 0) return relume::done();
    if (positions == nullptr) return nullPointer("positions");
    if (normals == nullptr) return nullPointer("normals");
    if (reflected == nullptr) return nullPointer("reflected");
    if (exponents == nullptr) return nullPointer("exponents");
    if (radiance == nullptr) return nullPointer("radiance");
    return relighter->relighter.glossyInGrid(vectors(positions, count), vectors(normals, count),
                                             vectors(reflected, count), {exponents, count}, vectors(radiance, count));
  });
}

namespace {

// An output as elements of T. [bytes: a multiple of sizeof(T)]
template <class T>
std::span<T> elements(void* output, std::size_t bytes) {
  return {static_cast<T*>(output), bytes / sizeof(T)};
}

Status checkBytes(const void* output, std::size_t bytes, std::size_t expected) {
  if (bytes != expected) return usage("bytes is " + std::to_string(bytes) + ", expected " + std::to_string(expected));
  if (output == nullptr && bytes > 0) return nullPointer("the output");
  return relume::done();
}

}  // namespace

relume_status relume_irradiance_map(const relume_relighter* relighter, void* rgba16f, size_t bytes) {
  return run(relighter, [&]() -> Status {
    const glm::uvec2 size = relighter->relighter.lightmapSize();
    if (Status ok = checkBytes(rgba16f, bytes, std::size_t{8} * size.x * size.y); !ok) return ok;
    return relighter->relighter.irradianceMap(elements<std::uint16_t>(rgba16f, bytes));
  });
}

relume_status relume_irradiance_map_l1(const relume_relighter* relighter, void* rgba16f, size_t bytes) {
  return run(relighter, [&]() -> Status {
    const glm::uvec2 size = relighter->relighter.lightmapSize();
    if (Status ok = checkBytes(rgba16f, bytes, std::size_t{32} * size.x * size.y); !ok) return ok;
    return relighter->relighter.irradianceMapL1(elements<std::uint16_t>(rgba16f, bytes));
  });
}

relume_status relume_ambient_volume(const relume_relighter* relighter, const float origin[3], const float spacing[3],
                                    const unsigned int resolution[3], float* cubes, size_t bytes) {
  return run(relighter, [&]() -> Status {
    if (origin == nullptr) return nullPointer("origin");
    if (spacing == nullptr) return nullPointer("spacing");
    if (resolution == nullptr) return nullPointer("resolution");
    if (cubes == nullptr && bytes > 0) return nullPointer("cubes");
    constexpr std::size_t kCubeBytes = 6 * sizeof(glm::vec3);
    if (bytes % kCubeBytes != 0) {
      return usage("bytes is " + std::to_string(bytes) + ", expected " + std::to_string(kCubeBytes) +
                   " for each point");
    }
    const relume::AmbientVolume volume{vec3(origin), vec3(spacing), {resolution[0], resolution[1], resolution[2]}};
    return relighter->relighter.ambientVolume(volume, elements<glm::vec3>(cubes, bytes));
  });
}

unsigned int relume_coefficients_per_cache(const relume_relighter* relighter) {
  return relighter == nullptr ? 0 : static_cast<unsigned int>(relighter->relighter.coefficientsPerCache());
}

relume_status relume_cache_coefficients(const relume_relighter* relighter, float* coefficients, size_t bytes) {
  return run(relighter, [&]() -> Status {
    const std::size_t count = static_cast<std::size_t>(relighter->relighter.coefficientsPerCache()) * relighter->caches;
    if (Status ok = checkBytes(coefficients, bytes, count * sizeof(float)); !ok) return ok;
    return relighter->relighter.cacheCoefficients(std::span<float>(coefficients, count));
  });
}

// ---- Textures

relume_status relume_resolve_texture_count(const relume_relighter* relighter, unsigned int* count) {
  return run(relighter, [&]() -> Status {
    if (count == nullptr) return nullPointer("count");
    const relume::Result<relume::TextureResolve> resolve = relighter->relighter.textureResolve();
    if (!resolve) return resolve.error();
    *count = static_cast<unsigned int>(resolve->textures.size());
    return relume::done();
  });
}

relume_status relume_resolve_texture_get_info(const relume_relighter* relighter, unsigned int texture,
                                              relume_resolve_texture* info) {
  return run(relighter, [&]() -> Status {
    const relume::Result<relume::TextureResolve> resolve = relighter->relighter.textureResolve();
    if (!resolve) return resolve.error();
    if (texture >= resolve->textures.size())
      return usage("texture is " + std::to_string(texture) + ", there are " + std::to_string(resolve->textures.size()));
    const relume::ResolveTexture& of = resolve->textures[texture];
    relume_resolve_texture filled{};
    filled.sampler = of.sampler;
    filled.shape = static_cast<relume_texture_shape>(of.shape);
    filled.format = static_cast<relume_texel_format>(of.format);
    filled.width = of.size.x;
    filled.height = of.size.y;
    filled.depth = of.size.z;
    filled.filtered = of.isFiltered ? 1 : 0;
    filled.light = of.isLight ? 1 : 0;
    filled.bytes = of.bytes;
    return fillStruct(info, filled);
  });
}

relume_status relume_resolve_texture_write(const relume_relighter* relighter, unsigned int texture, void* texels,
                                           size_t bytes) {
  return run(relighter, [&]() -> Status {
    if (texels == nullptr) return nullPointer("texels");
    return relighter->relighter.writeResolveTexture(texture, {static_cast<std::byte*>(texels), bytes});
  });
}

relume_status relume_resolve_uniforms(const relume_relighter* relighter, float grid[24]) {
  return run(relighter, [&]() -> Status {
    if (grid == nullptr) return nullPointer("grid");
    const relume::Result<relume::TextureResolve> resolve = relighter->relighter.textureResolve();
    if (!resolve) return resolve.error();
    static_assert(sizeof resolve->grid == 24 * sizeof(float));
    std::memcpy(grid, resolve->grid.data(), sizeof resolve->grid);
    return relume::done();
  });
}

relume_status relume_resolve_glsl(const relume_relighter* relighter, char* text, size_t bytes, size_t* length) {
  return run(relighter, [&]() -> Status {
    if (text == nullptr && bytes > 0) return nullPointer("text");
    const relume::Result<std::string> glsl = relighter->relighter.textureResolveGlsl();
    if (!glsl) return glsl.error();
    if (length != nullptr) *length = glsl->size();
    if (bytes > 0) text[glsl->copy(text, bytes - 1)] = '\0';
    return relume::done();
  });
}

// ---- OpenGL

const char* relume_gl_resolve_glsl(const relume_relighter* relighter) {
  const relume::GlResolve* gl = relighter == nullptr ? nullptr : relighter->relighter.gl();
  return gl == nullptr ? nullptr : gl->glsl().c_str();
}

relume_status relume_gl_bind_resolve(const relume_relighter* relighter) {
  return run(relighter, [&]() -> Status {
    const relume::GlResolve* gl = relighter->relighter.gl();
    if (gl == nullptr) return usage("this relighter has no OpenGL: RELUME_BACKEND_GL was not asked for");
    gl->bind();
    return relume::done();
  });
}

unsigned int relume_gl_surfel_program(const relume_relighter* relighter) {
  const relume::GlResolve* gl = relighter == nullptr ? nullptr : relighter->relighter.gl();
  return gl == nullptr ? 0 : gl->surfelProgram();
}

unsigned int relume_gl_moving_program(const relume_relighter* relighter) {
  const relume::GlResolve* gl = relighter == nullptr ? nullptr : relighter->relighter.gl();
  return gl == nullptr ? 0 : gl->movingProgram();
}
