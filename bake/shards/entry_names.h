// SPDX-License-Identifier: MIT
// The names under which a store has what bakes compute: hashes of all that each was made from, so that an edit changes
// the names of what it can change, and of nothing else.
#pragma once

#include "bake/shards/plan.h"
#include "bake/shards/shard.h"
#include "bake/store/store.h"

#include <string>

namespace relume {

class EntryNames {
 public:
  // options: with the sizes that chooseSizes() gives.
  EntryNames(const Scene& scene, const BakeOptions& options);

  // What receivers can see: the shapes that rays meet, views, options of the play space. And the caches of that.
  EntryName space() const;
  EntryName caches() const;
  // All but the links: level and options. Those options are left out that links alone depend on.
  EntryName plan() const;
  // What links are traced with, colours and names left out: surfels, hierarchy, caches, the shapes that rays meet, the
  // options of links. The threshold of all caches follows from it.
  EntryName threshold(const BakePlan& plan) const;
  // The links of a block, where the threshold is known: of threshold() and BakePlan::minKey.
  static EntryName links(const EntryName& threshold, float minKey);
  static EntryName block(const EntryName& links, const ShardNumber& number);

 private:
  const Scene& scene_;
  BakeOptions options_;
  std::vector<BakedInstance> instances_;
  std::string program_;
};

}  // namespace relume
