// SPDX-License-Identifier: MIT
// See plan_objects.h.
#include "runtime/gl/plan_objects.h"

#include "runtime/gl/errors.h"
#include "runtime/gl/program.h"
#include "runtime/passes/pack_textures.h"
#include "shaders/shared/layout.h"

#include <algorithm>
#include <cstring>
#include <new>
#include <string>
#include <utility>

namespace relume::gl {
namespace {

GLenum targetOf(TextureShape shape) {
  switch (shape) {
    case TextureShape::flat:
      return GL_TEXTURE_2D;
    case TextureShape::array:
      return GL_TEXTURE_2D_ARRAY;
    default:
      return GL_TEXTURE_3D;
  }
}

// How OpenGL stores texels, and what they are handed over as.
struct Format {
  GLenum stored, layout, type;
};

Format formatOf(GpuFormat format) {
  switch (format) {
    case GpuFormat::rgba16f:
      return {GL_RGBA16F, GL_RGBA, GL_HALF_FLOAT};
    case GpuFormat::rg16f:
      return {GL_RG16F, GL_RG, GL_HALF_FLOAT};
    case GpuFormat::rgba32f:
      return {GL_RGBA32F, GL_RGB, GL_FLOAT};
    case GpuFormat::rgba8snorm:
      return {GL_RGBA8_SNORM, GL_RGBA, GL_BYTE};
    default:
      return {GL_R8UI, GL_RED_INTEGER, GL_UNSIGNED_BYTE};
  }
}

GLsizei toSize(std::size_t v) { return static_cast<GLsizei>(v); }
GLsizei levelSize(std::uint32_t side, std::uint32_t level) { return toSize(std::max(side >> level, 1u)); }

std::size_t texelsOf(const GpuImage& image) {
  std::size_t texels = 0;
  for (std::uint32_t level = 0; level < image.levels; ++level)
    texels += std::size_t{std::max(image.size.x >> level, 1u)} * std::max(image.size.y >> level, 1u) * image.size.z;
  return texels;
}

GLenum usageOf(GpuUse use) {
  return use == GpuUse::constant ? GL_STATIC_DRAW : use == GpuUse::frame ? GL_STREAM_DRAW : GL_DYNAMIC_COPY;
}

Sampler makeMipSampler(const Functions& gl, bool clampU, bool clampV) {
  GLuint name = 0;
  gl.GenSamplers(1, &name);
  Sampler sampler(gl, name);
  gl.SamplerParameteri(name, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  gl.SamplerParameteri(name, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  gl.SamplerParameteri(name, GL_TEXTURE_WRAP_S, clampU ? GL_CLAMP_TO_EDGE : GL_REPEAT);
  gl.SamplerParameteri(name, GL_TEXTURE_WRAP_T, clampV ? GL_CLAMP_TO_EDGE : GL_REPEAT);
  return sampler;
}

}  // namespace

gpu::GroupThreads groupThreadsOf(const char* renderer) {
  const bool software = renderer && (std::strstr(renderer, "llvmpipe") || std::strstr(renderer, "softpipe"));
  return software ? gpu::GroupThreads::serial : gpu::GroupThreads::parallel;
}

gpu::GroupThreads groupThreadsOf(const Functions& gl, std::optional<gpu::GroupThreads> wanted) {
  return wanted ? *wanted : groupThreadsOf(reinterpret_cast<const char*>(gl.GetString(GL_RENDERER)));
}

GpuDevice deviceOf(const Functions& gl, gpu::GroupThreads threads) {
  GpuDevice device;
  GLint64 storage = 0;
  gl.GetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &storage);
  const auto limit = [&gl](GLenum what) {
    GLint value = 1;
    gl.GetIntegerv(what, &value);
    return static_cast<std::uint32_t>(std::max(value, 1));
  };
  device.storageBytes = static_cast<std::size_t>(storage);
  device.storageAlignment = limit(GL_SHADER_STORAGE_BUFFER_OFFSET_ALIGNMENT);
  device.imageSide = limit(GL_MAX_TEXTURE_SIZE);
  device.volumeSide = limit(GL_MAX_3D_TEXTURE_SIZE);
  // What every OpenGL has.
  device.sharedBytes = 32768;
  device.groups = 65535;
  device.isSerial = threads == gpu::GroupThreads::serial;
  // Buffers grow there.
  device.maxLights = 0;
  device.movingShapeBytes = 0;
  return device;
}

Buffer makeBuffer(const Functions& gl, std::span<const std::byte> data, std::size_t bytes, GLenum usage,
                  std::pmr::memory_resource* memory) {
  std::pmr::vector<std::byte> all(memory);
  if (!data.empty() && data.size() < bytes) {
    all.resize(bytes);
    std::copy(data.begin(), data.end(), all.begin());
    data = all;
  }
  GLuint name = 0;
  gl.GenBuffers(1, &name);
  Buffer buffer{Handle<detail::deleteBuffer>(gl, name), static_cast<GLsizeiptr>(bytes)};
  gl.BindBuffer(GL_COPY_WRITE_BUFFER, name);
  gl.BufferData(GL_COPY_WRITE_BUFFER, buffer.bytes, data.empty() ? nullptr : data.data(), usage);
  if (data.empty()) gl.ClearBufferData(GL_COPY_WRITE_BUFFER, GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, nullptr);
  return buffer;
}

PlanObjects::PlanObjects(const Functions& gl, const gpu::FramePlan& plan, std::pmr::memory_resource* memory)
    : gl_(gl), plan_(plan), memory_(memory), buffers_(memory), textures_(memory), programs_(memory), writes_(gl) {}

Texture PlanObjects::makeTexture(const GpuImage& image) const {
  const GLenum target = targetOf(image.shape), stored = formatOf(image.format).stored;
  const GLsizei width = toSize(image.size.x), height = toSize(image.size.y), levels = toSize(image.levels);
  GLuint name = 0;
  gl_.GenTextures(1, &name);
  Texture texture(gl_, name);
  gl_.ActiveTexture(GL_TEXTURE0 + RELUME_RESOLVE_UNIT_Y);
  gl_.BindTexture(target, name);
  if (image.shape == TextureShape::flat) {
    gl_.TexStorage2D(target, levels, stored, width, height);
  } else {
    gl_.TexStorage3D(target, levels, stored, width, height, toSize(image.size.z));
  }
  // Integers do not filter.
  const GLint filter = image.format == GpuFormat::r8ui ? GL_NEAREST : GL_LINEAR;
  gl_.TexParameteri(target, GL_TEXTURE_MIN_FILTER, filter);
  gl_.TexParameteri(target, GL_TEXTURE_MAG_FILTER, filter);
  for (const GLenum wrap : std::array<GLenum, 3>{GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R})
    gl_.TexParameteri(target, wrap, GL_CLAMP_TO_EDGE);
  return texture;
}

void PlanObjects::fillTexture(const GpuImage& image, const Texture& texture, const void* texels) const {
  const Format format = formatOf(image.format);
  const GLenum target = targetOf(image.shape);
  gl_.ActiveTexture(GL_TEXTURE0 + RELUME_RESOLVE_UNIT_Y);
  gl_.BindTexture(target, texture.get());
  gl_.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
  if (image.shape == TextureShape::flat) {
    gl_.TexSubImage2D(target, 0, 0, 0, toSize(image.size.x), toSize(image.size.y), format.layout, format.type, texels);
  } else {
    gl_.TexSubImage3D(target, 0, 0, 0, 0, toSize(image.size.x), toSize(image.size.y), toSize(image.size.z),
                      format.layout, format.type, texels);
  }
  gl_.PixelStorei(GL_UNPACK_ALIGNMENT, 4);
}

Status PlanObjects::make(std::string_view visibilityGlsl) {
  dropErrors(gl_);
  writes_.prepare();
  for (const GpuBuffer& buffer : plan_.buffers())
    buffers_.push_back(makeBuffer(gl_, buffer.contents, buffer.bytes, usageOf(buffer.use), memory_));
  for (const GpuImage& image : plan_.images()) {
    textures_.emplace_back();
    if (image.use == GpuUse::frame) continue;
    textures_.back() = makeTexture(image);
    const std::pmr::vector<std::byte> zeros(
        image.contents.empty() ? texelsOf(image) * texelBytes(image.format) : std::size_t{0}, memory_);
    fillTexture(image, textures_.back(), zeros.empty() ? image.contents.data() : zeros.data());
  }
  if (takeOutOfMemory(gl_))
    return Error{ErrorCode::unsupported, "this OpenGL has not enough memory for the bake's buffers"};
  for (const gpu::ProgramSource& source : plan_.programs()) {
    Result<Program> made = makeComputeProgram(gl_, source.path, source.allDefines(), visibilityGlsl);
    if (!made) return made.error();
    PlanProgram program{std::move(*made), std::pmr::vector<GLint>(memory_)};
    for (const gpu::Parameter& each : source.parameters)
      program.location.push_back(gl_.GetUniformLocation(program.name.get(), each.name));
    programs_.push_back(std::move(program));
  }
  const auto images = plan_.images();
  if (std::any_of(images.begin(), images.end(), [](const GpuImage& image) { return image.use == GpuUse::frame; })) {
    constexpr auto kFirst = static_cast<std::size_t>(GpuSampler::mipRepeat);
    for (std::size_t wrap = 0; wrap < 4; ++wrap)
      samplers_[kFirst + wrap] = makeMipSampler(gl_, (wrap & 1) != 0, (wrap & 2) != 0);
  }
  return done();
}

GLuint PlanObjects::program(std::string_view path) const {
  const auto sources = plan_.programs();
  const auto found = std::find_if(sources.begin(), sources.end(),
                                  [path](const gpu::ProgramSource& source) { return source.path == path; });
  return found == sources.end() ? 0 : programs_[static_cast<std::size_t>(found - sources.begin())].name.get();
}

void PlanObjects::makeSurfelLight() {
  if (!hasSurfelLight())
    buffers_[gpu::kSurfelLight] = makeBuffer(gl_, {}, surfelLightBytes(), usageOf(GpuUse::light), memory_);
}

void PlanObjects::makeDrivenImage(std::uint32_t image) {
  if (textures_[image].get() != 0) return;
  dropErrors(gl_);
  Texture made = makeTexture(plan_.images()[image]);
  if (takeOutOfMemory(gl_)) throw std::bad_alloc();
  textures_[image] = std::move(made);
}

std::size_t PlanObjects::textureBytes(GpuUse use) const {
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < textures_.size(); ++i) {
    const GpuImage& image = plan_.images()[i];
    if (textures_[i].get() != 0 && image.use == use) bytes += texelsOf(image) * texelBytes(image.format);
  }
  return bytes;
}

std::size_t PlanObjects::gridTextureBytes() const {
  std::size_t bytes = 0;
  for (std::uint32_t i = 0; plan_.gridImages() && i < 3; ++i) {
    const GpuImage& image = plan_.images()[*plan_.gridImages() + i];
    bytes += texelsOf(image) * texelBytes(image.format);
  }
  return bytes;
}

void PlanObjects::bind(std::span<const GpuBinding> bindings) const {
  for (const GpuBinding& each : bindings) {
    switch (each.kind) {
      case GpuBindingKind::uniformBuffer:
        gl_.BindBufferBase(GL_UNIFORM_BUFFER, each.binding, buffers_[each.resource].get());
        break;
      case GpuBindingKind::storageBuffer:
        if (each.bytes == 0) {
          gl_.BindBufferBase(GL_SHADER_STORAGE_BUFFER, each.binding, buffers_[each.resource].get());
        } else {
          gl_.BindBufferRange(GL_SHADER_STORAGE_BUFFER, each.binding, buffers_[each.resource].get(),
                              static_cast<GLintptr>(each.offset), static_cast<GLsizeiptr>(each.bytes));
        }
        break;
      case GpuBindingKind::storageImage:
        gl_.BindImageTexture(each.binding - RELUME_VULKAN_IMAGES, textures_[each.resource].get(), 0, GL_TRUE, 0,
                             GL_WRITE_ONLY, formatOf(plan_.images()[each.resource].format).stored);
        break;
      case GpuBindingKind::sampledImage:
        gl_.ActiveTexture(GL_TEXTURE0 + each.binding);
        gl_.BindTexture(targetOf(plan_.images()[each.resource].shape), textures_[each.resource].get());
        gl_.BindSampler(each.binding, samplers_[static_cast<std::size_t>(each.sampler)].get());
        break;
    }
  }
}

void PlanObjects::uploadImage(const GpuUpload& upload) const {
  const GpuImage& image = plan_.images()[upload.resource];
  const Format format = formatOf(image.format);
  gl_.ActiveTexture(GL_TEXTURE0 + RELUME_UNIT_EMISSION);
  gl_.BindTexture(GL_TEXTURE_2D, textures_[upload.resource].get());
  gl_.TexSubImage2D(GL_TEXTURE_2D, static_cast<GLint>(upload.level), 0, 0, levelSize(image.size.x, upload.level),
                    levelSize(image.size.y, upload.level), format.layout, format.type, upload.bytes.data());
}

void PlanObjects::upload(std::span<const GpuUpload> uploads) {
  for (const GpuUpload& each : uploads) {
    if (each.isImage) {
      uploadImage(each);
      continue;
    }
    // Buffers grow when needed.
    Buffer& buffer = buffers_[each.resource];
    if (static_cast<std::size_t>(buffer.bytes) < each.bytes.size()) {
      buffer = makeBuffer(gl_, each.bytes, each.bytes.size(), GL_STREAM_DRAW);
      continue;
    }
    writes_.write(buffer, 0, each.bytes);
  }
}

void PlanObjects::setParameters(std::uint32_t program, const GpuDispatch& dispatch) const {
  const GLuint name = programs_[program].name.get();
  const std::span<const gpu::Parameter> parameters = plan_.programs()[program].parameters;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const GLint location = programs_[program].location[i];
    // What this program does not read.
    if (location < 0) continue;
    std::array<GLuint, 3> u{};
    std::array<GLfloat, 3> f{};
    const std::byte* const from = dispatch.parameters.data() + parameters[i].offset;
    const bool isFloat =
        parameters[i].type == gpu::ParameterType::float1 || parameters[i].type == gpu::ParameterType::float3;
    // Words past a parameter's own are not read; those of the last one may lie past the end.
    const std::size_t words = std::min(sizeof u, dispatch.parameters.size() - parameters[i].offset);
    std::memcpy(isFloat ? static_cast<void*>(f.data()) : u.data(), from, words);
    switch (parameters[i].type) {
      case gpu::ParameterType::uint1:
        gl_.ProgramUniform1ui(name, location, u[0]);
        break;
      case gpu::ParameterType::uint2:
        gl_.ProgramUniform2ui(name, location, u[0], u[1]);
        break;
      case gpu::ParameterType::uint3:
        gl_.ProgramUniform3ui(name, location, u[0], u[1], u[2]);
        break;
      case gpu::ParameterType::float1:
        gl_.ProgramUniform1f(name, location, f[0]);
        break;
      case gpu::ParameterType::float3:
        gl_.ProgramUniform3f(name, location, f[0], f[1], f[2]);
        break;
    }
  }
}

void PlanObjects::run(std::size_t number, const GpuDispatch& dispatch) const {
  if (dispatch.waits) gl_.MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
  const GpuBindingSet& set = plan_.bindingSets()[dispatch.bindingSet];
  gl_.UseProgram(programs_[set.program].name.get());
  bind(set.bindings);
  if (const GLuint texture = plan_.hostTexture(number); texture != 0) {
    gl_.ActiveTexture(GL_TEXTURE0 + RELUME_UNIT_EMISSION);
    gl_.BindTexture(GL_TEXTURE_2D, texture);
  }
  setParameters(set.program, dispatch);
  gl_.DispatchCompute(dispatch.groups, 1, 1);
}

void PlanObjects::clearLight(const Bake& bake) {
  // All memory before anything is cleared.
  const std::pmr::vector<std::uint32_t> texels = gpu::darkTexels(bake.caches.lightmap, memory_);
  std::size_t bytes = 0;
  for (const std::uint32_t map : {gpu::kMapY, gpu::kMapCo, gpu::kMapCg})
    bytes = std::max(bytes, texelsOf(plan_.images()[map]) * texelBytes(plan_.images()[map].format));
  const std::pmr::vector<std::byte> zeros(bytes, memory_);

  gl_.BindBuffer(GL_COPY_WRITE_BUFFER, buffers_[gpu::kCacheLight].get());
  gl_.ClearBufferData(GL_COPY_WRITE_BUFFER, GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, nullptr);
  for (const std::uint32_t map : {gpu::kMapY, gpu::kMapCo, gpu::kMapCg})
    fillTexture(plan_.images()[map], textures_[map], zeros.data());
  writes_.write(buffers_[gpu::kTexelColors], 0, std::as_bytes(std::span(texels.data(), texels.size())));
}

}  // namespace relume::gl
