// SPDX-License-Identifier: MIT
// What excerpts in C++ presume that a game has: excerpts_test.py puts those paragraphs in front of an excerpt of which
// it has a name. A paragraph opens with the names that it declares; what it includes is what these need.

// jobs
#include <relume/relighter.h>
extern relume::ParallelFor jobs;

// lights
#include <relume/lights.h>
extern std::vector<relume::Light> lights;

// shadow
#include <relume/lights.h>
extern relume::Visibility shadow;

// shadows
#include <glm/vec3.hpp>
struct ShadowMap {
  void test(std::span<const glm::vec3> positions, std::span<const glm::vec3> normals, std::span<float> visible) const;
};
extern std::vector<ShadowMap> shadows;

// bake newBake
#include <relume/bake_data.h>
#include <relume/result.h>
extern relume::Result<relume::Bake> bake, newBake;

// relighter
#include <relume/relighter.h>
extern relume::Result<relume::Relighter> relighter;

// options
#include <relume/relighter.h>
extern relume::RelightOptions options;

// setup
#include <relume/lights.h>
extern relume::LightSetup setup;

// position normal
#include <glm/vec3.hpp>
extern glm::vec3 position, normal;

// uv
#include <glm/vec2.hpp>
extern glm::vec2 uv;

// viewRay roughness yours radiance albedo irradiance reflectance pi
#include <glm/geometric.hpp>
extern glm::vec3 viewRay, yours, radiance, albedo, irradiance, reflectance;
extern float roughness;
inline constexpr float pi = 3.14159265f;

// yourTexture yourUniform yourShader
#include <relume/relighter.h>
void yourTexture(const std::string& sampler, const glm::uvec3& size, std::span<const std::byte> texels);
void yourUniform(const char* name, std::span<const glm::vec4> values);
extern std::string yourShader;

// glfwGetProcAddress
relume::GlProc glfwGetProcAddress(const char* name);

// eglGetProcAddress
relume::GlProc eglGetProcAddress(const char* name);

// SDL_GL_GetProcAddress
relume::GlProc SDL_GL_GetProcAddress(const char* name);

// texels
#include <glm/vec3.hpp>
extern std::vector<glm::vec3> texels;

// glTexSubImage2D GL_TEXTURE_2D GL_RGBA GL_HALF_FLOAT
enum : unsigned { GL_TEXTURE_2D, GL_RGBA, GL_HALF_FLOAT };
void glTexSubImage2D(unsigned target, int level, int x, int y, int width, int height, unsigned format, unsigned type,
                     const void* texels);

// glGetUniformLocation glProgramUniform1i glProgramUniform1f glProgramUniform4fv
int glGetUniformLocation(unsigned program, const char* name);
void glProgramUniform1i(unsigned program, int location, int value);
void glProgramUniform1f(unsigned program, int location, float value);
void glProgramUniform4fv(unsigned program, int location, int count, const float* values);

// program
extern unsigned program;

// positions triangles brown crateToWorld otherCrateToWorld
#include <glm/mat4x3.hpp>
#include <glm/vec3.hpp>
extern std::vector<glm::vec3> positions;
extern std::vector<glm::uvec3> triangles;
extern glm::vec3 brown;
extern glm::mat4x3 crateToWorld, otherCrateToWorld;

// shapes parts
#include <relume/moving_shapes.h>
extern relume::Result<relume::MovingShapes> shapes;
extern std::vector<relume::MovingPart> parts;

// heap
#include <memory_resource>
extern std::pmr::monotonic_buffer_resource heap;

// physicalDevice commands
#include <vulkan/vulkan_core.h>
extern VkInstance instance;
extern VkPhysicalDevice physicalDevice;
extern VkDevice device;
extern VkCommandBuffer commands;

// executor passes
#include <relume/vulkan_executor.h>
extern relume::Result<std::unique_ptr<relume::VulkanExecutor>> executor;
extern relume::Result<relume::GpuPasses> passes;
extern relume::Result<relume::GpuFrame> frame;
extern relume::GpuDevice limits;
