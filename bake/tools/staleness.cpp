// SPDX-License-Identifier: MIT
// See staleness.h.
#include "bake/tools/staleness.h"

#include "bake/provenance.h"

#include <map>

namespace relume {
namespace {

// "option links.linksPerCache was 64, is 254"
void compareOptions(const BakeOptions& options, const Provenance& provenance, std::vector<std::string>& others) {
  if (provenance.optionsJson == optionsToJson(options)) return;
  const std::size_t found = others.size();
  const Result<BakeOptions> before = optionsFromJson(provenance.optionsJson, BakeOptions{});
  if (before) {
    std::map<std::string, std::string> values;
    for (const OptionInfo& info : listOptions(*before)) values[info.name] = info.value;
    for (const OptionInfo& info : listOptions(options)) {
      if (values[info.name] != info.value)
        others.push_back("option " + info.name + " was " + values[info.name] + ", is " + info.value);
    }
  }
  if (others.size() == found) others.push_back("the options of this version are others than the bake's");
}

}  // namespace

std::vector<std::string> Staleness::sentences() const {
  std::vector<std::string> all;
  for (const PartChange& change : parts) all.push_back(toString(change));
  all.insert(all.end(), others.begin(), others.end());
  return all;
}

Staleness findStaleness(const Scene& scene, const BakeOptions* options, const Bake& bake) {
  const Provenance& then = bake.provenance;
  Staleness stale;
  const std::vector<BakedInstance> now = describeInstances(scene);
  if (then.sceneHash != hashScene(scene, now)) {
    stale.parts = compareParts(bake.instances, now);
    if (then.viewHash != hashViews(scene)) stale.others.push_back("cameras or play volumes changed");
    if (stale.upToDate()) stale.others.push_back("the order of the scene's parts changed");
  }
  if (then.algorithmVersion != kAlgorithmVersion)
    stale.others.push_back("algorithm version was " + std::to_string(then.algorithmVersion) + ", is " +
                           std::to_string(kAlgorithmVersion));
  if (options != nullptr) compareOptions(*options, then, stale.others);
  return stale;
}

}  // namespace relume
