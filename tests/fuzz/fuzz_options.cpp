// SPDX-License-Identifier: MIT
// libFuzzer: any text as an options file. What is read must come back from its own JSON unchanged.
#include "bake/options.h"

#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace relume;
  const std::string text(reinterpret_cast<const char*>(data), size);
  const Result<BakeOptions> options = optionsFromJson(text, presetOptions(Preset::high));
  if (options) {
    if (checkOptions(*options)) {
      const std::string json = optionsToJson(*options);
      const Result<BakeOptions> again = optionsFromJson(json, BakeOptions{});
      if (!again || optionsToJson(*again) != json) std::abort();
    }
  }
  BakeOptions target;
  for (const char* name : {"surfels.count", "caches.gridResolution", "links.kind", "embreeIsa", "caches.gridSpacing"})
    (void)static_cast<bool>(setOption(target, name, text));
  return 0;
}
