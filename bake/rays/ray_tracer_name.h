// SPDX-License-Identifier: MIT
// How Embree is started, and what traces the rays, by name and version, as bakes keep it: another one may give other
// hits.
#pragma once

#include <string>

struct RTCDeviceTy;

namespace relume {

// What rtcNewDevice() is given for an instruction set; empty = Embree's choice.
std::string deviceConfig(const std::string& isa);
// "embree 3.13.5 isa=avx2"; an empty `isa`, Embree's choice for this processor, becomes "best:" and the widest rays it
// has then ("best:ray8"), since it gives other hits elsewhere.
std::string rayTracerName(RTCDeviceTy* device, const std::string& isa);
// The same of a device of its own; empty when Embree cannot start with `isa`.
std::string rayTracerName(const std::string& isa);

}  // namespace relume
