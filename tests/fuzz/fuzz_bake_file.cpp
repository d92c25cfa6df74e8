// SPDX-License-Identifier: MIT
// libFuzzer: any bytes as a bake file. What parses must validate without a crash and be written again as the same
// bytes; packed ones as the bytes of the same bake, plain and packed.
#include "formats/chunks.h"
#include "formats/validate.h"
#include "relume/bake_file.h"
#include "tests/fuzz/mutate_bake.h"

#include <algorithm>
#include <cstdlib>

using namespace relume;

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max, unsigned seed) {
  fuzz::Random random(seed);
  return fuzz::store(fuzz::mutateBake({data, size}, max, random), data, max);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::byte> file(reinterpret_cast<const std::byte*>(data), size);
  Result<Bake> bake = parseBake(file, nullptr);
  const bool verified = static_cast<bool>(bake);
  if (!verified && bake.error().message.find("checksum") != std::string::npos)
    bake = parseBake(file, nullptr, Checksums::skip);  // what a game that trusts its files would load
  if (!bake) return 0;
  for (const Finding& finding : validateBake(*bake)) {
    if (static_cast<int>(finding.check) < 200) std::abort();  // the reader lets no structural damage through
  }
  const Result<std::vector<std::byte>> again = serializeBake(*bake);
  if (!again) std::abort();
  if (isPacked(file)) {
    const Result<std::vector<std::byte>> packed = serializePackedBake(*bake, identityOf(file));
    const Result<Bake> unpacked = packed ? parseBake(*packed, nullptr) : packed.error();
    if (!unpacked || serializeBake(*unpacked).value() != *again) std::abort();
  } else if (verified && !std::equal(again->begin(), again->end(), file.begin(), file.end())) {
    std::abort();
  }
  return 0;
}
