// SPDX-License-Identifier: MIT
// The compute programs of the passes: which file of shaders/, with which definitions, and what is bound to it. Those
// definitions that Vulkan takes as specialisation constants are kept apart, so that one SPIR-V serves all their values.
#pragma once

#include "relume/gpu_passes.h"
#include "relume/links.h"
#include "runtime/shared/bands.h"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace relume::gpu {

// How a device runs the threads of a work group. It decides time alone: tests hold both cuts against each other.
enum class GroupThreads {
  serial,    // one after the other, barriers are dear, few groups run at once: software rasterisers
  parallel,  // side by side: hardware
};

// Threads that share a cache in light_caches.comp, and caches of a work group.
struct CacheGroup {
  int lanes = 32, caches = 2;
};
// sharedBytes: of a work group's memory.
CacheGroup chooseCacheGroup(GroupThreads threads, const CacheBands& bands, std::size_t sharedBytes = 32768);
// [byte] What of it a group takes.
std::size_t sharedBytesOf(const CacheGroup& group, const CacheBands& bands);

// Threads of a work group that pulls, and inner nodes it gets at most.
struct PullGroup {
  int threads = 128;
  std::uint32_t nodes = 1024;
};
PullGroup choosePullGroup(GroupThreads threads);

// Threads and caches of a work group of occlude_links.comp, and shares of a cache's links. parts: of a frame, at most.
struct OccludeGroup {
  std::uint32_t threads = 1, caches = 1, lanes = 1;
};
OccludeGroup chooseOccludeGroup(GroupThreads threads, std::uint32_t parts);

enum class ParameterType : std::uint8_t { uint1, uint2, uint3, float1, float3 };

// A push constant of Vulkan, a plain uniform of OpenGL. name: lives as long as the program.
struct Parameter {
  const char* name;
  ParameterType type;
  std::size_t offset;  // [byte]
};

struct ProgramConstant {
  const char* name;
  std::uint32_t id, value;
};

using DefineList = std::vector<std::pair<std::string, std::string>>;

struct ProgramSource {
  const char* path;  // below shaders/
  DefineList defines;
  std::vector<ProgramConstant> constants = {};
  std::span<const Parameter> parameters = {};

  std::size_t parameterBytes() const;
  // For OpenGL: with the constants as definitions.
  DefineList allDefines() const;
};

ProgramSource bounceProgram(const CacheBands& bands, bool grid);
ProgramSource driveProgram();
ProgramSource surfelProgram();
ProgramSource pullProgram(const PullGroup& group, bool top);
// nodeSteps: LinkArrays::nodeSteps. map: for the caches of the light map; group: chosen for their bands. moving: for
// frames with moving parts.
ProgramSource cacheProgram(const CacheBands& bands, LinkKind kind, const CacheGroup& group, int nodeSteps, bool map,
                           bool moving = false);
// Of moving parts: the light of their patches, and what they hide of links.
ProgramSource partLightProgram(const CacheBands& bands);
ProgramSource occludeProgram(LinkKind kind, const OccludeGroup& group, int nodeSteps);
ProgramSource fillProgram(const CacheBands& bands, bool texels);

// Text for Vulkan, #version included. failed: an include that does not exist.
Result<std::string> vulkanGlsl(const ProgramSource& source);

// What SPIR-V is found by: path and definitions.
std::string spirvKey(const ProgramSource& source);

// Every program that has SPIR-V in a build for these bands, each once.
std::vector<ProgramSource> programsOf(std::span<const CacheBands> bands);

}  // namespace relume::gpu
