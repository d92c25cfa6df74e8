// SPDX-License-Identifier: MIT
// A plan as a file (formats/README.md): a bake without links inside, then what else links are traced with. What is read
// is checked so that tracing with it stays within its arrays and its time within what the options ask for.
#include "bake/budget/choose_sizes.h"
#include "bake/links/link_tracer.h"
#include "bake/shards/plan.h"
#include "formats/chunk_arrays.h"
#include "formats/file_io.h"
#include "formats/limits.h"
#include "formats/validate.h"
#include "relume/bake_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <new>
#include <string>
#include <utility>

namespace relume {
namespace {

constexpr const char *kBake = "bake", *kThreshold = "link.threshold", *kSide = "surfel.side", *kTile = "surfel.tile",
                     *kEmission = "surfel.traced", *kTestKind = "test.kind", *kTestLight = "test.light",
                     *kTestMean = "test.mean", *kTestAt = "test.at", *kTestInstance = "test.instance",
                     *kTestPlace = "test.place", *kTestFound = "test.found";
constexpr std::uint64_t kSideWords = 2;
constexpr float kMaxTestLight = 1e30f;  // [W/m²]
constexpr int kMaxNesting = 16;         // of tiles: a grid in a tile has 4 x 4

// A side: the first tile; then columns, nested, rows and corner in 15, 1, 14 and 2 bits.
std::array<std::uint32_t, kSideWords> packSide(const SurfelMap::Side& side) {
  return {side.firstTile, side.columns | std::uint32_t{side.nested} << 15 | std::uint32_t{side.rows} << 16 |
                              std::uint32_t{side.corner} << 30};
}

SurfelMap::Side unpackSide(std::uint32_t first, std::uint32_t bits) {
  SurfelMap::Side side;
  side.firstTile = first;
  side.columns = static_cast<std::uint16_t>(bits & 0x7FFFu);
  side.nested = static_cast<std::uint16_t>(bits >> 15 & 1u);
  side.rows = static_cast<std::uint16_t>(bits >> 16 & 0x3FFFu);
  side.corner = static_cast<std::uint16_t>(bits >> 30);
  return side;
}

struct PlanArrays {
  std::vector<std::byte> bake;
  std::vector<std::uint32_t> side, testKind;
  std::vector<float> testLight;  // of each light but the sky, one after another
  std::vector<glm::vec3> testPlace,
      testFound;  // positions, normals, geometric normals; one set of rays, then the other
};

Result<std::vector<Chunk>> chunksOf(const BakePlan& plan, PlanArrays& arrays) {
  Result<std::vector<std::byte>> bake = serializeBake(plan.bake);
  if (!bake) return bake.error();
  arrays.bake = std::move(*bake);
  arrays.side.reserve(plan.map.sides.size() * kSideWords);
  for (std::size_t i = 0; i < plan.map.sides.size(); ++i) {
    const auto words = packSide(plan.map.sides[i]);
    arrays.side.insert(arrays.side.end(), words.begin(), words.end());
  }
  const TestRays& test = plan.test;
  for (const TestLight& light : test.lights) {
    arrays.testKind.push_back(static_cast<std::uint32_t>(light.kind));
    arrays.testLight.insert(arrays.testLight.end(), light.surfelIrradiance.begin(), light.surfelIrradiance.end());
  }
  for (const auto* row : {&test.receivers.positionWorld, &test.receivers.normal, &test.receivers.geometricNormal})
    arrays.testPlace.insert(arrays.testPlace.end(), row->begin(), row->end());
  for (const auto& set : test.irradiance) arrays.testFound.insert(arrays.testFound.end(), set.begin(), set.end());
  return std::vector<Chunk>{archiveChunk(kBake, arrays.bake),
                            chunkOf<float>(kThreshold, std::span(&plan.minKey, 1)),
                            chunkOf<std::uint32_t>(kSide, arrays.side, kSideWords),
                            chunkOf<std::uint32_t>(kTile, plan.map.tile),
                            chunkOf<glm::vec3>(kEmission, plan.tracedEmission),
                            chunkOf<std::uint32_t>(kTestKind, arrays.testKind),
                            chunkOf<float>(kTestLight, arrays.testLight),
                            chunkOf<float>(kTestMean, test.meanLight),
                            chunkOf<std::uint32_t>(kTestAt, test.receivers.at),
                            chunkOf<std::uint32_t>(kTestInstance, test.receivers.instance),
                            chunkOf<glm::vec3>(kTestPlace, arrays.testPlace),
                            chunkOf<glm::vec3>(kTestFound, arrays.testFound)};
}

std::string element(const char* chunk, std::size_t index) {
  return "chunk " + std::string(chunk) + "[" + std::to_string(index) + "]: ";
}

// The options are those that this program would write, and fit what was made with them.
Status checkOptionsOf(BakePlan& plan) {
  const std::string& json = plan.bake.provenance.optionsJson;
  const Result<BakeOptions> options = optionsFromJson(json, BakeOptions{});
  if (!options) return invalidFile("chunk bake: options: " + options.error().message);
  plan.options = *options;
  if (const Status status = checkOptions(plan.options); !status)
    return invalidFile("chunk bake: options: " + status.error().message);
  if (optionsToJson(plan.options) != json) return invalidFile("chunk bake: options: not as a plan writes them");
  const LinkOptions& o = plan.options.links;
  const Links& links = plan.bake.links;
  if (links.kind != o.kind || links.bands != (o.kind == LinkKind::sh ? o.bands : 0u))
    return invalidFile("chunk bake: links: not of the kind that the options say");
  if (links.count() != 0)
    return invalidFile("chunk bake: expected a bake without links, found " + std::to_string(links.count()));
  if (plan.bake.hierarchy.skyDirection.size() != o.skyPatches)
    return invalidFile("chunk bake: expected " + std::to_string(o.skyPatches) +
                       " sky patches, as the options say, found " +
                       std::to_string(plan.bake.hierarchy.skyDirection.size()));
  const Bake& bake = plan.bake;
  const Result<BakeOptions> chosen = chooseLinks(plan.options, bake.surfels, bake.hierarchy, bake.caches);
  if (!chosen) return invalidFile("chunk bake: " + chosen.error().message);
  plan.chosen = *chosen;
  const Status fits = LinkTracer::check(bake.surfels, bake.hierarchy, bake.caches, plan.chosen.links);
  return fits ? done() : Status(invalidFile("chunk bake: " + fits.error().message));
}

// Grids of tiles lie inside the array, and a tile is in one of them, or is all that several sides have.
Status checkTiles(const SurfelMap& map, std::uint32_t surfels) {
  constexpr std::uint32_t kInner = SurfelMap::kInnerAlong * SurfelMap::kInnerAlong;
  const std::size_t count = map.tile.size();
  std::vector<std::uint8_t> depth(count, 0);  // 0: in no grid yet
  for (std::size_t i = 0; i < map.sides.size(); ++i) {
    const SurfelMap::Side& side = map.sides[i];
    if (side.columns == 0) continue;
    if (side.rows == 0 || side.corner > 2 || side.firstTile > count || side.tileCount() > count - side.firstTile)
      return invalidFile(element(kSide, i) + "expected tiles within the " + std::to_string(count) + " of the map");
    for (std::uint32_t t = 0; t < side.tileCount(); ++t) {
      if (std::exchange(depth[side.firstTile + t], std::uint8_t{1}) != 0 && side.tileCount() > 1)
        return invalidFile(element(kSide, i) + "expected tiles of its own, found those of another side");
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t content = map.tile[i];
    if (content == kNone) continue;
    if (!SurfelMap::isInner(content)) {
      if (content >= surfels)
        return invalidFile(element(kTile, i) + "expected a surfel below " + std::to_string(surfels) + ", found " +
                           std::to_string(content));
      continue;
    }
    const std::size_t first = SurfelMap::firstInner(content);
    if (first <= i || first > count || kInner > count - first || depth[i] >= kMaxNesting)
      return invalidFile(element(kTile, i) + "expected a grid of tiles after it, nested less than " +
                         std::to_string(kMaxNesting) + " deep");
    for (std::size_t t = first; t < first + kInner; ++t) {
      if (std::exchange(depth[t], static_cast<std::uint8_t>(depth[i] + 1)) != 0)
        return invalidFile(element(kTile, i) + "expected a grid of its own, found tiles of another");
    }
  }
  return done();
}

constexpr std::size_t kMaxTestLights = 64;

struct TestArrays {
  Array<std::uint32_t> kind;
  Array<float> light, mean;
  Array<std::uint32_t> at, instance;
  Array<glm::vec3> place, found;
};

Status checkRows(const char* chunk, std::size_t expected, std::size_t found) {
  if (found == expected) return done();
  return invalidFile("chunk " + std::string(chunk) + ": expected " + std::to_string(expected) + " rows, found " +
                     std::to_string(found));
}

bool isWithin(const glm::vec3& v, float most) {
  const glm::vec3 size = glm::abs(v);
  return size.x <= most && size.y <= most && size.z <= most;
}

// The lights of these arrays. invalidFile: sizes or numbers that do not fit the bake.
Result<std::vector<TestLight>> takeTestLights(const TestArrays& arrays, std::size_t surfels) {
  std::vector<TestLight> lights;
  if (arrays.kind.size() > kMaxTestLights)
    return invalidFile("chunk test.kind: expected at most " + std::to_string(kMaxTestLights) + " lights, found " +
                       std::to_string(arrays.kind.size()));
  std::span<const float> left = arrays.light.span();
  for (std::size_t i = 0; i < arrays.kind.size(); ++i) {
    const std::uint32_t kind = arrays.kind[i];
    if (kind > static_cast<std::uint32_t>(TestLightKind::lamp))
      return invalidFile(element(kTestKind, i) + "expected 0 to 2, found " + std::to_string(kind));
    TestLight& one = lights.emplace_back();
    one.kind = static_cast<TestLightKind>(kind);
    if (one.kind == TestLightKind::sky) continue;
    if (left.size() < surfels) return invalidFile("chunk test.light: expected a number for each surfel and light");
    one.surfelIrradiance.assign(left.begin(), left.begin() + static_cast<std::ptrdiff_t>(surfels));
    left = left.subspan(surfels);
  }
  if (!left.empty()) return invalidFile("chunk test.light: expected a number for each surfel and light");
  for (std::size_t i = 0; i < arrays.light.size(); ++i) {
    if (!(arrays.light[i] >= 0.0f && arrays.light[i] <= kMaxTestLight))
      return invalidFile(element(kTestLight, i) + "expected 0 to 1e30 W/m²");
  }
  return lights;
}

// The test rays of these arrays. invalidFile: sizes or numbers that do not fit the bake.
Result<TestRays> takeTestRays(const TestArrays& arrays, const Bake& bake) {
  Result<std::vector<TestLight>> lights = takeTestLights(arrays, bake.surfels.count());
  if (!lights) return lights.error();
  const std::size_t count = arrays.at.size(), each = count * lights->size();
  for (const Status& status :
       {checkRows(kTestMean, lights->size(), arrays.mean.size()),
        checkRows(kTestInstance, count, arrays.instance.size()), checkRows(kTestPlace, 3 * count, arrays.place.size()),
        checkRows(kTestFound, 2 * each, arrays.found.size())}) {
    if (!status) return status.error();
  }
  for (std::size_t i = 0; i < arrays.mean.size(); ++i) {
    if (!(arrays.mean[i] >= 0.0f && arrays.mean[i] <= kMaxTestLight))
      return invalidFile(element(kTestMean, i) + "expected 0 to 1e30 W/m²");
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (arrays.instance[i] >= bake.instances.size())
      return invalidFile(element(kTestInstance, i) + "expected an instance below " +
                         std::to_string(bake.instances.size()) + ", found " + std::to_string(arrays.instance[i]));
  }
  for (std::size_t i = 0; i < arrays.place.size(); ++i) {
    if (!isWithin(arrays.place[i], kMaxTestLight)) return invalidFile(element(kTestPlace, i) + "expected numbers");
  }
  for (std::size_t i = 0; i < arrays.found.size(); ++i) {
    if (!isWithin(arrays.found[i], kMaxTestLight))
      return invalidFile(element(kTestFound, i) + "expected -1e30 to 1e30 W/m²");
  }
  TestRays test;
  test.lights = std::move(*lights);
  test.meanLight = arrays.mean.toVector();
  test.receivers.at = arrays.at.toVector();
  test.receivers.instance = arrays.instance.toVector();
  const auto part = [](const Array<glm::vec3>& rows, std::size_t which, std::size_t size) {
    const auto begin = rows.span().begin() + static_cast<std::ptrdiff_t>(which * size);
    return std::vector<glm::vec3>(begin, begin + static_cast<std::ptrdiff_t>(size));
  };
  test.receivers.positionWorld = part(arrays.place, 0, count);
  test.receivers.normal = part(arrays.place, 1, count);
  test.receivers.geometricNormal = part(arrays.place, 2, count);
  for (std::size_t set = 0; set < test.irradiance.size(); ++set) test.irradiance[set] = part(arrays.found, set, each);
  return test;
}

Status checkPlan(BakePlan& plan) {
  if (const Status status = checkBake(plan.bake); !status)
    return Error{status.error().code, "chunk bake: " + status.error().message};
  if (const Status status = checkOptionsOf(plan); !status) return status;
  if (!std::isfinite(plan.minKey)) return invalidFile("chunk link.threshold: expected a finite number");
  const std::size_t emission = plan.tracedEmission.size(), surfels = plan.bake.surfels.count();
  if (emission != 0 && emission != surfels)
    return invalidFile("chunk surfel.traced: expected 0 or " + std::to_string(surfels) + " rows, found " +
                       std::to_string(emission));
  for (std::size_t i = 0; i < emission; ++i) {
    if (!isRadiance(plan.tracedEmission[i])) return invalidFile(element(kEmission, i) + "expected 0 to 1e9 W/m²/sr");
  }
  return checkTiles(plan.map, plan.bake.surfels.count());
}

Result<BakePlan> assemblePlan(std::span<const std::byte> bytes, const std::shared_ptr<const void>& owner) {
  const auto chunks = readChunks(bytes, std::pmr::new_delete_resource(), kPlanFileType);
  if (!chunks) return chunks.error();
  if (const Status status = verifyChunks(*chunks); !status) return status.error();
  ChunkReader reader(*chunks);
  const std::span<const std::byte> inner = reader.take(kBake, ElementType::archive, 1);
  const auto threshold = reader.takeArray<float>(kThreshold, owner);
  const auto side = reader.takeArray<std::uint32_t>(kSide, owner, kSideWords);
  const auto tile = reader.takeArray<std::uint32_t>(kTile, owner);
  const auto emission = reader.takeArray<glm::vec3>(kEmission, owner);
  TestArrays test;
  test.kind = reader.takeArray<std::uint32_t>(kTestKind, owner);
  test.light = reader.takeArray<float>(kTestLight, owner);
  test.mean = reader.takeArray<float>(kTestMean, owner);
  test.at = reader.takeArray<std::uint32_t>(kTestAt, owner);
  test.instance = reader.takeArray<std::uint32_t>(kTestInstance, owner);
  test.place = reader.takeArray<glm::vec3>(kTestPlace, owner);
  test.found = reader.takeArray<glm::vec3>(kTestFound, owner);
  reader.finish();
  if (reader.failed()) return reader.error();
  if (threshold.size() != 1)
    return invalidFile("chunk link.threshold: expected 1 number, found " + std::to_string(threshold.size()));

  BakePlan plan;
  Result<Bake> bake = parseBake(inner, owner, Checksums::skip);  // the chunk around it has one
  if (!bake) return Error{bake.error().code, "chunk bake: " + bake.error().message};
  plan.bake = std::move(*bake);
  plan.minKey = threshold[0];
  std::vector<SurfelMap::Side> sides;
  sides.reserve(side.size() / kSideWords);
  for (std::size_t i = 0; i < side.size(); i += kSideWords) sides.push_back(unpackSide(side[i], side[i + 1]));
  plan.map.sides = BlockPalette<SurfelMap::Side>(sides);
  plan.map.tile = tile.toVector();
  plan.tracedEmission = emission.toVector();
  plan.identity = identityOf(bytes);
  Result<TestRays> rays = takeTestRays(test, plan.bake);
  if (!rays) return rays.error();
  plan.test = std::move(*rays);
  if (const Status status = checkPlan(plan); !status) return status.error();
  return plan;
}

}  // namespace

Status writePlan(const BakePlan& plan, const std::filesystem::path& path) {
  PlanArrays arrays;
  const Result<std::vector<Chunk>> chunks = chunksOf(plan, arrays);
  if (!chunks) return Error{chunks.error().code, path.string() + ": not written: " + chunks.error().message};
  return writeFileAtomically(
      path, [&](const ByteSink& sink) { return writeChunks(*chunks, sink, kPlanFileType.version, kPlanFileType); });
}

Result<std::vector<std::byte>> serializePlan(const BakePlan& plan) {
  PlanArrays arrays;
  const Result<std::vector<Chunk>> chunks = chunksOf(plan, arrays);
  if (!chunks) return chunks.error();
  return joinChunks(*chunks, kPlanFileType.version, kPlanFileType);
}

Result<BakePlan> parsePlan(std::span<const std::byte> bytes, const std::shared_ptr<const void>& owner) {
  if (reinterpret_cast<std::uintptr_t>(bytes.data()) % 8 != 0)
    return Error{ErrorCode::usage, "the memory of a plan must be aligned to 8 bytes"};
  try {
    return assemblePlan(bytes, owner);
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::memory, "out of memory"};
  }
}

Result<BakePlan> readPlan(const std::filesystem::path& path) {
  const Result<FileBytes> file = readFile(path);
  if (!file) return file.error();
  Result<BakePlan> plan = parsePlan(file->bytes, file->owner);
  if (!plan) return Error{plan.error().code, path.string() + ": " + plan.error().message};
  return plan;
}

}  // namespace relume
