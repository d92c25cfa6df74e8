// SPDX-License-Identifier: MIT
// How a frame adds dispatches: for the files that make up FramePlan::frame().
#pragma once

#include "runtime/passes/frame_plan.h"

#include <algorithm>
#include <cstring>

namespace relume::gpu {

template <class Parameters>
Parameters FramePlan::batchParameters(const LinkBatch& links) const {
  Parameters parameters{};
  parameters.relumeEndCache = links.endCache;
  parameters.relumeFirstLink = links.firstLink;
  parameters.relumeWordOffset = links.wordOffset;
  parameters.relumeHalfOffset = links.halfOffset;
  parameters.relumeShapeStride = shapeStride_;
  return parameters;
}

template <class Parameters>
void FramePlan::dispatch(GpuPass pass, std::uint32_t set, Parameters parameters, std::uint32_t Parameters::*begin,
                         std::uint32_t first, std::uint32_t end, std::uint32_t perGroup, bool waits,
                         std::uint32_t texture) {
  static_assert(sizeof(Parameters) <= kGpuParameterBytes);
  // The number of groups of one dispatch is limited.
  const std::uint64_t most = std::uint64_t{device_.groups} * perGroup;
  while (first < end) {
    GpuDispatch& added = dispatches_.emplace_back();
    hostTextures_.push_back(texture);
    added.pass = pass;
    added.waits = waits;
    added.bindingSet = set;
    const auto count = static_cast<std::uint32_t>(std::min<std::uint64_t>(end - first, most));
    added.groups = (count + perGroup - 1) / perGroup;
    parameters.*begin = first;
    std::memcpy(added.parameters.data(), &parameters, sizeof parameters);
    first += count;
    waits = false;
  }
}

}  // namespace relume::gpu
