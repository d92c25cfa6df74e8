// SPDX-License-Identifier: MIT
// See ray_tracer_name.h.
#include "bake/rays/ray_tracer_name.h"

#include <embree3/rtcore.h>

#include <memory>

namespace relume {

// Without the cache for subdivision surfaces, which are not used here. Embree allocates its 128 MiB under a lock that
// it keeps when there is no memory for them: every device that is made or released later would wait for ever.
std::string deviceConfig(const std::string& isa) {
  return "tessellation_cache_size=0" + (isa.empty() ? "" : ",isa=" + isa);
}

std::string rayTracerName(RTCDeviceTy* device, const std::string& isa) {
  std::string chosen = isa;
  if (isa.empty()) {
    const bool ray16 = rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0;
    const bool ray8 = rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) != 0;
    chosen = std::string("best:") + (ray16 ? "ray16" : ray8 ? "ray8" : "ray4");
  }
  const auto version = rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_VERSION);
  return "embree " + std::to_string(version / 10000) + "." + std::to_string(version / 100 % 100) + "." +
         std::to_string(version % 100) + " isa=" + chosen;
}

std::string rayTracerName(const std::string& isa) {
  const std::string config = deviceConfig(isa);
  const std::unique_ptr<RTCDeviceTy, void (*)(RTCDeviceTy*)> device(rtcNewDevice(config.c_str()), [](RTCDeviceTy* d) {
    if (d != nullptr) rtcReleaseDevice(d);
  });
  return device ? rayTracerName(device.get(), isa) : std::string();
}

}  // namespace relume
