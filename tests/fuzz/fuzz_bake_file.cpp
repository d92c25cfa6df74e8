// SPDX-License-Identifier: MIT
// libFuzzer: any bytes as a bake file. The first byte chooses whether the checksums are made to fit, so that mutations
// reach what lies behind them. What parses must validate without a crash and be written again as the same bytes.
#include "formats/bake_file.h"
#include "formats/validate.h"
#include "tests/formats/corrupt_file.h"

#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace relume;
  if (size < 1) return 0;
  const auto* first = reinterpret_cast<const std::byte*>(data);
  Bytes file(first + 1, first + size);
  if (data[0] & 1) {
    if (file.size() >= kHeaderBytes) putAt<std::uint64_t>(file, 24, file.size());
    reseal(file);
  }
  const Result<Bake> bake = parseBake(file, nullptr, data[0] & 2 ? Checksums::skip : Checksums::verify);
  if (!bake) return 0;
  for (const Finding& finding : validateBake(*bake)) {
    if (static_cast<int>(finding.check) < 200) std::abort();  // the reader lets no structural damage through
  }
  const Result<std::vector<std::byte>> again = serializeBake(*bake);
  if (!again || (!(data[0] & 2) && *again != file)) std::abort();
  return 0;
}
