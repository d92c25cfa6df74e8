// SPDX-License-Identifier: MIT
// See ray_tracer_name.h.
#include "bake/rays/ray_tracer_name.h"

#include <embree3/rtcore.h>

#include <memory>

namespace relume {

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
  const std::string config = isa.empty() ? "" : "isa=" + isa;
  const std::unique_ptr<RTCDeviceTy, void (*)(RTCDeviceTy*)> device(rtcNewDevice(config.c_str()), [](RTCDeviceTy* d) {
    if (d != nullptr) rtcReleaseDevice(d);
  });
  return device ? rayTracerName(device.get(), isa) : std::string();
}

}  // namespace relume
