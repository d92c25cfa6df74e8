// SPDX-License-Identifier: MIT
// See programs.h.
#include "runtime/passes/programs.h"

#include "runtime/passes/pack_textures.h"
#include "runtime/shared/shader_text.h"
#include "shaders/shared/layout.h"

#include <algorithm>
#include <set>
#include <type_traits>

namespace relume::gpu {
namespace {

template <class T>
constexpr ParameterType typeOf() {
  if constexpr (std::is_same_v<T, float>) return ParameterType::float1;
  if constexpr (std::is_same_v<T, glm::vec3>) return ParameterType::float3;
  if constexpr (std::is_same_v<T, glm::uvec2>) return ParameterType::uint2;
  if constexpr (std::is_same_v<T, glm::uvec3>) return ParameterType::uint3;
  return ParameterType::uint1;
}

// The parameters of the structs of shaders/shared/layout.h.
#define RELUME_PARAMETER(type, name) {#name, typeOf<decltype(Struct::name)>(), offsetof(Struct, name)},
constexpr auto kBounce = [] {
  using Struct = gl::RelumeBounceParameters;
  return std::to_array<Parameter>({RELUME_BOUNCE_PARAMETERS(RELUME_PARAMETER)});
}();
constexpr auto kDrive = [] {
  using Struct = gl::RelumeDriveParameters;
  return std::to_array<Parameter>({RELUME_DRIVE_PARAMETERS(RELUME_PARAMETER)});
}();
constexpr auto kSurfels = [] {
  using Struct = gl::RelumeSurfelParameters;
  return std::to_array<Parameter>({RELUME_SURFEL_PARAMETERS(RELUME_PARAMETER)});
}();
constexpr auto kPull = [] {
  using Struct = gl::RelumePullParameters;
  return std::to_array<Parameter>({RELUME_PULL_PARAMETERS(RELUME_PARAMETER)});
}();
constexpr auto kCaches = [] {
  using Struct = gl::RelumeCacheParameters;
  return std::to_array<Parameter>({RELUME_CACHE_PARAMETERS(RELUME_PARAMETER)});
}();
constexpr auto kPartLight = [] {
  using Struct = gl::RelumePartLightParameters;
  return std::to_array<Parameter>({RELUME_PART_LIGHT_PARAMETERS(RELUME_PARAMETER)});
}();
constexpr auto kOcclude = [] {
  using Struct = gl::RelumeOccludeParameters;
  return std::to_array<Parameter>({RELUME_OCCLUDE_PARAMETERS(RELUME_PARAMETER)});
}();
constexpr auto kFill = [] {
  using Struct = gl::RelumeFillParameters;
  return std::to_array<Parameter>({RELUME_FILL_PARAMETERS(RELUME_PARAMETER)});
}();
#undef RELUME_PARAMETER

std::size_t bytesOf(ParameterType type) {
  return type == ParameterType::uint2 ? 8 : type == ParameterType::uint3 || type == ParameterType::float3 ? 12 : 4;
}

// Passes know no bands but those that their own caches have.
DefineList bandsOf(int luma, int chroma, bool irradianceOnMap) {
  return {{"RELUME_LUMA_BANDS", std::to_string(luma)},
          {"RELUME_CHROMA_BANDS", std::to_string(chroma)},
          {"RELUME_MAP_IRRADIANCE", irradianceOnMap ? "1" : "0"}};
}

// RELUME_LINK_KIND: links packed again are a kind of the shaders' own, RELUME_LINKS_REPACKED of
// shaders/lib/link_sums.glsl.
std::string kindOf(LinkKind kind, int nodeSteps) {
  constexpr std::uint32_t kRepacked = 6;
  return std::to_string(nodeSteps < 0 ? static_cast<std::uint32_t>(kind) : kRepacked);
}

}  // namespace

CacheGroup chooseCacheGroup(GroupThreads threads, const CacheBands& bands, std::size_t sharedBytes) {
  // Shared memory holds all sums of a group.
  constexpr int kLanes = 32;
  const std::size_t bytesPerCache = sharedBytesOf({kLanes, 1}, bands);
  if (threads == GroupThreads::serial || bytesPerCache > sharedBytes) return {1, 64};
  return {kLanes, static_cast<int>(std::min<std::size_t>(sharedBytes / bytesPerCache, 2))};
}

std::size_t sharedBytesOf(const CacheGroup& group, const CacheBands& bands) {
  // One, of a thread, where none is shared.
  const int caches = group.lanes > 1 ? group.caches : 1;
  return static_cast<std::size_t>(caches * group.lanes) * 2 * cacheBytes(bands);
}

OccludeGroup chooseOccludeGroup(GroupThreads threads, std::uint32_t parts) {
  if (threads == GroupThreads::parallel) return {128, 8, 32};
  // Mesa's software driver ends all loops of a thread after 65536 rounds: the more parts, the fewer links to a thread.
  return parts <= 16 ? OccludeGroup{64, 16, 8} : OccludeGroup{64, 2, 32};
}

PullGroup choosePullGroup(GroupThreads threads) {
  return threads == GroupThreads::serial ? PullGroup{8, 4096} : PullGroup{128, 1024};
}

std::size_t ProgramSource::parameterBytes() const {
  return parameters.empty() ? 0 : parameters.back().offset + bytesOf(parameters.back().type);
}

DefineList ProgramSource::allDefines() const {
  DefineList all = defines;
  for (const ProgramConstant& each : constants) all.emplace_back(each.name, std::to_string(each.value));
  return all;
}

ProgramSource bounceProgram(const CacheBands& bands, bool grid) {
  DefineList defines = bandsOf(bands.lumaBands, bands.chromaBands, !grid && bands.irradianceOnMap);
  defines.emplace_back("RELUME_BOUNCE_GRID", grid ? "1" : "0");
  return {"bounce_surfels.comp", std::move(defines), {}, kBounce};
}

ProgramSource driveProgram() { return {"drive_emitters.comp", {}, {}, kDrive}; }

ProgramSource surfelProgram() { return {"light_surfels.comp", {}, {}, kSurfels}; }

ProgramSource pullProgram(const PullGroup& group, bool top) {
  return {"pull.comp",
          {{"RELUME_PULL_TOP", top ? "1" : "0"}},
          {{"RELUME_PULL_THREADS", 0, static_cast<std::uint32_t>(group.threads)}},
          kPull};
}

ProgramSource cacheProgram(const CacheBands& bands, LinkKind kind, const CacheGroup& group, int nodeSteps, bool map,
                           bool moving) {
  const CacheBands own = map ? bands.ofMap() : bands;
  DefineList defines = bandsOf(own.lumaBands, own.chromaBands, map && bands.irradianceOnMap);
  defines.emplace_back("RELUME_MAP", map ? "1" : "0");
  defines.emplace_back("RELUME_LINK_KIND", kindOf(kind, nodeSteps));
  return {"light_caches.comp",
          std::move(defines),
          {{"RELUME_THREADS", 0, static_cast<std::uint32_t>(group.lanes * group.caches)},
           {"RELUME_CACHES", 1, static_cast<std::uint32_t>(group.caches)},
           {"RELUME_NODE_STEPS", 2, static_cast<std::uint32_t>(std::max(nodeSteps, 0))},
           {"RELUME_LANES", 3, static_cast<std::uint32_t>(group.lanes)},
           {"RELUME_SHARED_CACHES", 4, static_cast<std::uint32_t>(group.lanes > 1 ? group.caches : 1)},
           {"RELUME_MOVING", 5, moving ? 1u : 0u}},
          kCaches};
}

ProgramSource partLightProgram(const CacheBands& bands) {
  return {"light_parts.comp", bandsOf(bands.lumaBands, bands.chromaBands, false), {}, kPartLight};
}

ProgramSource occludeProgram(LinkKind kind, const OccludeGroup& group, int nodeSteps) {
  DefineList defines = bandsOf(1, 1, false);
  defines.emplace_back("RELUME_LINK_KIND", kindOf(kind, nodeSteps));
  return {"occlude_links.comp",
          std::move(defines),
          {{"RELUME_THREADS", 0, group.threads},
           {"RELUME_CACHES", 1, group.caches},
           {"RELUME_NODE_STEPS", 2, static_cast<std::uint32_t>(std::max(nodeSteps, 0))},
           {"RELUME_LANES", 3, group.lanes}},
          kOcclude};
}

ProgramSource fillProgram(const CacheBands& bands, bool texels) {
  // Texels are sums of vectors, whatever the bands.
  DefineList defines = texels ? bandsOf(1, 1, false) : bandsOf(bands.lumaBands, bands.chromaBands, false);
  defines.emplace_back("RELUME_FILL_TEXELS", texels ? "1" : "0");
  return {"fill_grid_texture.comp", std::move(defines), {}, kFill};
}

Result<std::string> vulkanGlsl(const ProgramSource& source) {
  DefineList defines = source.defines;
  defines.emplace_back("RELUME_VULKAN", "1");
  Result<std::string> text = expandShader(source.path, defines);
  if (!text) return text.error();
  return "#version 450\n" + *text;
}

std::string spirvKey(const ProgramSource& source) {
  std::string key = source.path;
  for (const auto& [name, value] : source.defines) key.append(" ").append(name).append("=").append(value);
  return key;
}

std::vector<ProgramSource> programsOf(std::span<const CacheBands> bands) {
  std::vector<ProgramSource> programs;
  std::set<std::string> keys;
  const auto add = [&](ProgramSource source) {
    if (keys.insert(spirvKey(source)).second) programs.push_back(std::move(source));
  };
  add(driveProgram());
  add(surfelProgram());
  for (const bool top : {false, true}) add(pullProgram({}, top));
  for (const LinkKind kind : kLinkKinds) add(occludeProgram(kind, {}, -1));
  add(occludeProgram(LinkKind::oct6, {}, 0));
  for (CacheBands each : bands) {
    for (const bool grid : {false, true}) {
      add(bounceProgram(each, grid));
      add(fillProgram(each, grid));
    }
    add(partLightProgram(each));
    for (const LinkKind kind : kLinkKinds) {
      each.irradianceOnMap = kind == LinkKind::irradiance;
      // The light map has other bands where glossy receivers read it.
      for (int variant = 0; variant < 3; ++variant) {
        each.glossy = variant == 2;
        add(cacheProgram(each, kind, {}, -1, variant > 0));
        if (kind == LinkKind::oct6) add(cacheProgram(each, kind, {}, 0, variant > 0));
      }
    }
  }
  return programs;
}

}  // namespace relume::gpu
