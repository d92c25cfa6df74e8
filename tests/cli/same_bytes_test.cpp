// SPDX-License-Identifier: MIT
// The same level and options give the same bytes: at any number of threads, in a fresh process, wherever the system
// puts its memory, with whatever vectors the ray tracer uses, on whichever maker's processor.
#include "formats/chunks.h"
#include "relume/bake_file.h"
#include "tests/cli/cli_fixture.h"

#include <sys/personality.h>

namespace relume {
namespace {

class SameBytes : public CliFixture {};

TEST_F(SameBytes, threadsProcessesAndAddressesDoNotMatter) {
  const std::string level = RELUME_SOURCE_DIR "/samples/level/two_rooms.glb";
  const auto baked = [&](const std::string& threads, bool fixedAddresses) {
    const ProgramResult result =
        runProgram({"bake", level, "-o", out_, "--force", "--preset", "draft", "--surfels", "4096", "--lightmap-caches",
                    "400", "--rays", "256", "--walks", "20000", "--threads", threads, "--progress", "none"},
                   folder_, [&] {
                     if (fixedAddresses) ::personality(ADDR_NO_RANDOMIZE);
                   });
    EXPECT_EQ(result.status, 0) << result.err;
    return readAll(out_);
  };
  const std::string first = baked("1", false);
  ASSERT_GT(first.size(), 100000u);
  EXPECT_NE(first.find("isa=avx2"), std::string::npos) << "the ray tracer's instruction set is fixed and recorded";
  for (const char* threads : {"1", "2", "7"}) EXPECT_TRUE(baked(threads, false) == first) << threads << " threads";
  for (const char* threads : {"1", "7"})
    EXPECT_TRUE(baked(threads, true) == first) << threads << " threads, fixed addresses";
}

// Embree's approximate reciprocals differ between instruction sets as they do between makers of processors. All that
// differs is what the bake says of itself. One ray in ten million slips through an edge in one of them only
// (docs/notes/determinism.md): of the three million cast here none does.
TEST_F(SameBytes, instructionSetsOfTheRayTracerDoNotMatter) {
  const auto chunksOf = [&](const std::string& isa) {
    const ProgramResult result =
        run({"bake", RELUME_SOURCE_DIR "/samples/level/two_rooms.glb", "-o", out_, "--preset", "draft", "--surfels",
             "2048", "--walks", "131072", "--isa", isa, "--progress", "none"});
    EXPECT_EQ(result.status, 0) << result.err;
    const auto chunks = listChunks(out_);
    EXPECT_TRUE(chunks);
    return chunks ? *chunks : std::vector<ChunkInfo>{};
  };
  const std::vector<ChunkInfo> first = chunksOf("avx2");
  ASSERT_GT(first.size(), 10u);
  for (const char* isa : {"sse4.2", ""}) {
    const std::vector<ChunkInfo> other = chunksOf(isa);
    ASSERT_EQ(other.size(), first.size());
    for (std::size_t i = 0; i < first.size(); ++i) {
      if (first[i].name == "provenance") continue;
      EXPECT_EQ(other[i].hash, first[i].hash) << isa << ": " << first[i].name;
    }
  }
}

#if defined(__x86_64__)
// An emulated processor, whose estimates of 1 / x and 1 / sqrt(x) are exact, stands for another maker's. With these
// options a certificate that is read by the processor's own estimates differs in its last digits.
TEST_F(SameBytes, makersOfProcessorsDoNotMatter) {
  if (std::system("command -v qemu-x86_64 > /dev/null") != 0) GTEST_SKIP() << "qemu-x86_64 is not installed";
  const std::vector<std::string> arguments = {"bake",    RELUME_SOURCE_DIR "/samples/level/two_rooms.glb",
                                              "-o",      out_,
                                              "--force", "--preset",
                                              "draft",   "--walks",
                                              "1000",    "--surfels",
                                              "64",      "--grid-caches",
                                              "16",      "--lightmap-caches",
                                              "24",      "--links",
                                              "16",      "--rays",
                                              "32",      "--sky-patches",
                                              "8",       "--placement",
                                              "halton",  "--progress",
                                              "none"};
  const ProgramResult native = run(arguments);
  ASSERT_EQ(native.status, 0) << native.err;
  const std::string first = readAll(out_);
  ASSERT_GT(first.size(), 10000u);
  const ProgramResult emulated = runProgram(arguments, folder_, [&] {
    std::vector<const char*> argv = {"qemu-x86_64", "-cpu", "max", RELUME_BINARY};
    for (const std::string& argument : arguments) argv.push_back(argument.c_str());
    argv.push_back(nullptr);
    ::execvp(argv[0], const_cast<char* const*>(argv.data()));
    ::_exit(127);
  });
  ASSERT_EQ(emulated.status, 0) << emulated.err;
  EXPECT_TRUE(readAll(out_) == first);
}
#endif

}  // namespace
}  // namespace relume
