// SPDX-License-Identifier: MIT
// See stored_stages.h.
#include "bake/shards/stored_stages.h"

#include "bake/base/byte_stream.h"
#include "bake/caches/caches_bytes.h"
#include "bake/shards/said.h"
#include "bake/visibility/play_space_bytes.h"

#include <optional>

namespace relume {
namespace {

// What the store has under a name, with what was said of it; nothing where it is missing, or not for this scene.
template <class T, class Read>
std::optional<T> findStage(const EntryName& name, const Scene& scene, const Read& read, EntryCache& store,
                           Context& context) {
  const std::optional<EntryBytes> entry = store.find(name, context);
  if (!entry) return std::nullopt;
  const auto unpacked = unpackSaid(entry->bytes);
  std::optional<T> found;
  if (unpacked) {
    ByteReader from(unpacked->behind);
    found = read(from, scene);
  }
  if (!found) {
    store.reject(name, "what it holds does not fit the level");
    return std::nullopt;
  }
  for (const Said& said : unpacked->said) context.message(said.severity, said.text);
  return found;
}

template <class T, class Make, class Write>
Result<T> makeStage(const EntryName& name, const Make& make, const Write& write, EntryCache& store, Context& context) {
  const SaidRecorder recorder(context);
  Result<T> made = make();
  if (!made) return made;
  ByteWriter bytes;
  write(*made, bytes);
  store.keep(name, packSaid(recorder.said(), bytes.bytes()), context);
  return made;
}

}  // namespace

PlaceStages storedStages(const Scene& scene, const BakeOptions& options, const EntryNames& names, EntryCache& store) {
  const PlaceStages made = placeStages(options);
  PlaceStages stages;
  stages.findSpace = [&scene, &names, &store, made](const RayTracer& tracer, Context& context) {
    const EntryName name = names.space();
    if (auto found = findStage<PlaySpace>(name, scene, readPlaySpace, store, context))
      return Result<PlaySpace>(std::move(*found));
    return makeStage<PlaySpace>(
        name, [&] { return made.findSpace(tracer, context); }, writePlaySpace, store, context);
  };
  stages.placeCaches = [&scene, &names, &store, made](const RayTracer& tracer, const PlaySpace& space,
                                                      Context& context) {
    const EntryName name = names.caches();
    if (auto found = findStage<PlacedCaches>(name, scene, readCaches, store, context))
      return Result<PlacedCaches>(std::move(*found));
    return makeStage<PlacedCaches>(
        name, [&] { return made.placeCaches(tracer, space, context); }, writeCaches, store, context);
  };
  return stages;
}

}  // namespace relume
