// SPDX-License-Identifier: MIT
// See level_shader.h.
#include "tools/gl_scene/level_shader.h"

#include "tools/gl_scene/gl_level.h"
#include "tools/gl_scene/gl_program.h"
#include "tools/gl_scene/shadow_maps.h"

#include <glm/gtc/type_ptr.hpp>
#include <glm/vec4.hpp>

#include <cmath>

namespace relume {
namespace {

// Irradiance of a punctual light without its shadow, as LightSetup defines it.
const char* kLights = R"(
const uint levelMaxLights = relumeShadowCount;
uniform uint levelLightCount;
uniform vec4 levelLightIntensity[levelMaxLights];  // w: 0 directional, 1 point, 2 spot
uniform vec4 levelLightPosition[levelMaxLights];   // w: range
uniform vec4 levelLightDirection[levelMaxLights];
uniform vec2 levelLightCone[levelMaxLights];       // cosines of outer and inner angle
vec3 levelLightIrradiance(uint i, vec3 p, vec3 n) {
  vec3 intensity = levelLightIntensity[i].rgb, direction = levelLightDirection[i].xyz;
  float kind = levelLightIntensity[i].w, range = levelLightPosition[i].w;
  if (kind < 0.5) return intensity * max(-dot(direction, n), 0.0);
  vec3 toLight = levelLightPosition[i].xyz - p;
  float d2 = dot(toLight, toLight), d = sqrt(d2);
  float factor = max(dot(toLight, n), 0.0) / (d * max(d2, 1e-8));
  if (range > 0.0) {
    float share = d2 / (range * range);
    factor *= max(1.0 - share * share, 0.0);
  }
  if (kind > 1.5) {
    vec2 cone = levelLightCone[i];
    float t = clamp((-dot(direction, toLight / d) - cone.x) / max(cone.y - cone.x, 0.001), 0.0, 1.0);
    factor *= t * t;
  }
  return intensity * factor;
}
vec3 levelDirect(vec3 p, vec3 n) {
  vec3 sum = vec3(0.0);
  for (uint i = 0u; i < levelLightCount; ++i) {
    vec3 e = levelLightIrradiance(i, p, n);
    if (e.r + e.g + e.b > 0.0) sum += e * relumeVisibility(i, p, n);
  }
  return sum;
}
)";

const char* kLinks = R"(
vec3 levelLinks(vec3 p, vec3 n) {
  // The triangle's own normal, on the side of n.
  vec3 plane = cross(dFdx(p), dFdy(p));
  float size = length(plane);
  plane = size > 0.0 ? plane * (dot(plane, n) < 0.0 ? -1.0 / size : 1.0 / size) : n;
  vec2 uv;
  return levelOnLightmap(uv) ? relumeIrradianceLightmap(uv, n, plane) : relumeIrradianceGrid(p, n);
}
// Radiance in a lobe about r.
vec3 levelGlossy(vec3 p, vec3 n, vec3 r, float exponent) {
  vec2 uv;
  return levelOnLightmap(uv) ? relumeGlossyLightmap(uv, r, exponent) : relumeGlossyGrid(p, n, r, exponent);
}
)";

const char* kNoLinks =
    "vec3 levelLinks(vec3 p, vec3 n) { return vec3(0.0); }\n"
    "vec3 levelGlossy(vec3 p, vec3 n, vec3 r, float exponent) { return vec3(0.0); }\n";

}  // namespace

Result<GlProgram> makeLevelProgram(const Relighter* relighter, const std::string& mainGlsl) {
  const std::string vertex = "#version 430\n" + levelVertexGlsl() + "void main() { levelVertex(); }\n";
  const std::string fragment = "#version 430\n" + (relighter ? relighter->gl()->glsl() : std::string()) +
                               ShadowMaps::glsl() + levelMaterialGlsl() + kLights + (relighter ? kLinks : kNoLinks) +
                               mainGlsl;
  return linkProgram("level", vertex, fragment);
}

void setLevelLights(GLuint program, std::span<const Light> lights) {
  const auto location = [&](const std::string& name) { return glGetUniformLocation(program, name.c_str()); };
  glProgramUniform1ui(program, location("levelLightCount"), static_cast<GLuint>(lights.size()));
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const Light& light = lights[i];
    const std::string at = "[" + std::to_string(i) + "]";
    const glm::vec4 intensity(light.intensity, static_cast<float>(light.kind)),
        position(light.positionWorld, light.range), direction(light.direction, 0.0f);
    glProgramUniform4fv(program, location("levelLightIntensity" + at), 1, glm::value_ptr(intensity));
    glProgramUniform4fv(program, location("levelLightPosition" + at), 1, glm::value_ptr(position));
    glProgramUniform4fv(program, location("levelLightDirection" + at), 1, glm::value_ptr(direction));
    glProgramUniform2f(program, location("levelLightCone" + at), std::cos(light.outerConeRad),
                       std::cos(light.innerConeRad));
  }
}

}  // namespace relume
