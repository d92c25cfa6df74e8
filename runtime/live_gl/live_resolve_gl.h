// SPDX-License-Identifier: MIT
// What a shader of the host's includes to read light without a bake (shaders/live_resolve.glsl), by names and texture
// units of the host's choice, and its uniforms.
#pragma once

#include "relume/live_light.h"
#include "relume/result.h"
#include "runtime/voxels/voxel_grid.h"

#include <cstdint>
#include <span>
#include <string>

namespace relume {

namespace gl {
struct Functions;
}

// A volume as the text reads it.
struct ResolvedVolume {
  VolumeGrid grid;
  int layer = 0;  // of the cells' texture, at which its own begin
  VolumeReach reach;
};

// usage: a prefix that GLSL's names cannot begin with, two units that are the same, one that OpenGL does not have.
Status checkLiveGlNames(const gl::Functions& gl, const LiveGlNames& names);
// [names as above]
Result<std::string> liveResolveGlsl(const LiveGlNames& names);
// Of a program that has that text. usage: not a linked program; another of its samplers has one of the units.
Status checkTextureUnits(const gl::Functions& gl, std::uint32_t program, const LiveGlNames& names);
// Whether a program has had setResolvedVolumes() since it was linked, of volumes.
bool hasResolvedVolumes(const gl::Functions& gl, std::uint32_t program, const std::string& prefix);
// Uniforms of a program that has that text. Volumes from the outermost on, kMaxCascades at most; none = no light.
void setResolvedVolumes(const gl::Functions& gl, std::uint32_t program, const std::string& prefix,
                        std::span<const ResolvedVolume> volumes);

}  // namespace relume
