// SPDX-License-Identifier: MIT
// See level_shader.h.
#include "tools/gl_scene/level_shader.h"

#include "runtime/live_gl/live_resolve_gl.h"
#include "tools/gl_scene/edit_fields.h"
#include "tools/gl_scene/gl_level.h"
#include "tools/gl_scene/gl_program.h"
#include "tools/gl_scene/shadow_maps.h"

#include <glm/gtc/type_ptr.hpp>
#include <glm/vec4.hpp>

#include <cmath>

namespace relume {
namespace {

// Irradiance of a punctual light without its shadow, as LightSetup defines it.
const char* kLightsGlsl = R"(
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
// The triangle's own normal, on the side of n.
vec3 levelPlane(vec3 n) {
  vec3 plane = cross(dFdx(levelPlace), dFdy(levelPlace));
  float size = length(plane);
  return size > 0.0 ? plane * (dot(plane, n) < 0.0 ? -1.0 / size : 1.0 / size) : n;
}
vec3 levelDirect(vec3 p, vec3 n) {
  vec3 sum = vec3(0.0), plane = levelPlane(n);
  for (uint i = 0u; i < levelLightCount; ++i) {
    vec3 e = levelLightIrradiance(i, p, n);
    if (e.r + e.g + e.b > 0.0) sum += e * relumeVisibility(i, p, plane);
  }
  return sum;
}
)";

// What surfaces mirror: relume/glossy.h and directHighlights() of the path tracer; a test compares the pictures.
const char* kGlossGlsl = R"(
float levelExponent(float roughness) {
  float alpha2 = roughness * roughness * roughness * roughness;
  return alpha2 * 1e4 > 0.5 ? clamp(0.5 / alpha2 - 0.5, 1.0, 1e4) : 1e4;
}
float levelSpecularShare(float f0, float roughness, float cosine) {
  vec4 r = vec4(-1.0, -0.0275, -0.572, 0.022) * roughness + vec4(1.0, 0.0425, 1.04, -0.04);
  float a = min(r.x * r.x, exp2(-9.28 * cosine)) * r.x + r.y;
  float scale = r.z - 1.04 * a, bias = max(r.w + 1.04 * a, 0.0);
  float once = clamp(f0 * scale + bias, 0.0, 1.0);
  float missed = clamp(1.0 - scale - bias, 0.0, 1.0), average = f0 + (1.0 - f0) / 21.0;
  return min(once + once * average * missed / (1.0 - average * missed), 1.0);
}
// The exponent at which caches are asked for a surface that mirrors as sharply: what their bands carry, roughness 0.6 and up
// (glossyShare() of relume/glossy.h). OpenGL has no rays for the rest, and a lobe too wide is better than one that rings.
float levelCacheExponent(float exponent) { return min(exponent, 3.3580247); }
// What caches take of a lobe where somebody else takes the rest: glossyShare() of glossyRoughness().
float levelCacheShare(float exponent) {
  return smoothstep(0.4, 0.6, sqrt(sqrt(0.5 / (max(exponent, 1.0) + 0.5))));
}
// n: unit; toEye: unit. Of irradiance / pi and of the lobe's light.
void levelSplitReflectance(vec3 baseColor, vec2 metalRough, vec3 n, vec3 toEye, out vec3 diffuse, out vec3 specular) {
  float c = clamp(dot(n, toEye), 0.0, 1.0), dielectric = levelSpecularShare(0.04, metalRough.y, c);
  diffuse = (1.0 - metalRough.x) * (1.0 - dielectric) * baseColor;
  vec3 metal = vec3(levelSpecularShare(baseColor.r, metalRough.y, c), levelSpecularShare(baseColor.g, metalRough.y, c),
                    levelSpecularShare(baseColor.b, metalRough.y, c));
  specular = (1.0 - metalRough.x) * vec3(dielectric) + metalRough.x * metal;
}
// Radiance of the lights in a lobe about r, shadowed. toEye: tells the side of the surface.
vec3 levelHighlights(vec3 p, vec3 r, float exponent, vec3 toEye) {
  vec3 sum = vec3(0.0), plane = levelPlane(toEye);
  for (uint i = 0u; i < levelLightCount; ++i) {
    vec3 toLight = levelLightIntensity[i].w < 0.5 ? -levelLightDirection[i].xyz : normalize(levelLightPosition[i].xyz - p);
    float cosine = dot(toLight, r);
    if (cosine <= 0.0 || dot(toLight, plane) <= 0.0) continue;
    vec3 e = levelLightIrradiance(i, p, toLight);
    if (e.r + e.g + e.b > 0.0)
      sum += (exponent + 1.0) * 0.15915494 * pow(cosine, exponent) * e * relumeVisibility(i, p, plane);
  }
  return sum;
}
)";

const char* kLinks = R"(
vec3 levelLinks(vec3 p, vec3 n) {
  vec2 uv;
  return levelOnLightmap(uv) ? relumeIrradianceLightmap(uv, n, levelPlane(n)) : levelGrid(p, n);
}
// Radiance in a lobe about r.
vec3 levelGlossy(vec3 p, vec3 n, vec3 r, float exponent) {
  vec2 uv;
  return levelOnLightmap(uv) ? relumeGlossyLightmap(uv, r, exponent) : relumeGlossyGrid(p, n, r, exponent);
}
)";

// The bake's, corrected where the level was edited. What is drawn may be no surface of the bake's: levelIsEdited.
const char* kEditedLinks = R"(
uniform bool levelHasEdits;
vec3 levelLinks(vec3 p, vec3 n) {
  vec2 uv;
  vec3 baked = levelOnLightmap(uv) ? relumeIrradianceLightmap(uv, n, levelPlane(n)) : levelGrid(p, n);
  if (!levelHasEdits) return baked;
  vec2 share = levelIsEdited ? vec2(1.0) : relumeEditShare(p);
  if (!(share.x > 0.0)) return baked;
  return relumeBlendEdited(baked, relumeBeforeIrradiance(p, n), relumeAfterIrradiance(p, n), share);
}
vec3 levelGlossy(vec3 p, vec3 n, vec3 r, float exponent) {
  vec2 uv;
  return levelOnLightmap(uv) ? relumeGlossyLightmap(uv, r, exponent) : relumeGlossyGrid(p, n, r, exponent);
}
)";

const char* kNoLinks =
    "vec3 levelLinks(vec3 p, vec3 n) { return vec3(0.0); }\n"
    "vec3 levelGlossy(vec3 p, vec3 n, vec3 r, float exponent) { return vec3(0.0); }\n";

const char* kLiveLinks =
    "vec3 levelLinks(vec3 p, vec3 n) { return relumeLiveIrradiance(p, n); }\n"
    "vec3 levelGlossy(vec3 p, vec3 n, vec3 r, float exponent) { return relumeLiveGlossy(p, n, r, exponent); }\n";

std::string gridDefine(GridLookup lookup) {
  const char* const function = lookup == GridLookup::smooth    ? "relumeIrradianceGridSmooth"
                               : lookup == GridLookup::texture ? "relumeIrradianceGridTexture"
                                                               : "relumeIrradianceGrid";
  return std::string("#define levelGrid ") + function + "\n";
}

// resolve: what reads indirect light; links: levelLinks() and levelGlossy() by it.
Result<GlProgram> linkLevel(const std::string& resolve, const std::string& links, const std::string& mainGlsl) {
  const std::string vertex = "#version 430\n" + levelVertexGlsl() + "void main() { levelVertex(); }\n";
  const std::string fragment = "#version 430\n" + resolve + ShadowMaps::glsl() + levelMaterialGlsl() + kLightsGlsl +
                               kGlossGlsl + links + mainGlsl;
  return linkProgram("level", vertex, fragment);
}

}  // namespace

Result<GlProgram> makeLevelProgram(const Relighter* relighter, const std::string& mainGlsl, GridLookup lookup) {
  if (!relighter) return linkLevel("", kNoLinks, mainGlsl);
  return linkLevel(relighter->gl()->glsl(), gridDefine(lookup) + kLinks, mainGlsl);
}

Result<GlProgram> makeEditedProgram(const Relighter& relighter, const std::string& mainGlsl, GridLookup lookup) {
  const Result<std::string> edits = EditFields::glsl();
  if (!edits) return edits.error();
  return linkLevel(relighter.gl()->glsl() + *edits, gridDefine(lookup) + kEditedLinks, mainGlsl);
}

std::string levelConstant(const char* name, bool value) {
  return std::string("const bool ") + name + (value ? " = true;\n" : " = false;\n");
}

Result<GlProgram> makeDepthProgram() {
  return linkProgram("depth", "#version 430\n" + levelVertexGlsl() + "void main() { levelVertex(); }\n",
                     "#version 430\n" + levelMaterialGlsl() + "void main() { if (!levelOpaque()) discard; }\n");
}

Result<GlProgram> makeLiveProgram(const std::string& mainGlsl) {
  const Result<std::string> resolve = liveResolveGlsl({});
  if (!resolve) return resolve.error();
  return linkLevel(*resolve, kLiveLinks, mainGlsl);
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
