// SPDX-License-Identifier: MIT
// What commands say of the error that a bake certifies, and of the nodes that it is on.
#include "relume/bake_file.h"
#include "tests/cli/cli_fixture.h"
#include "tests/formats/small_bake.h"

#include <nlohmann/json.hpp>

namespace relume {
namespace {

class CertificateCli : public CliFixture {
 protected:
  // A bake whose two parts, "floor" and "lamp", add these to the mean squared error.
  std::string bakeOfParts(float floor, float lamp) {
    Bake bake = makeSmallCertifiedBake();
    bake.certificate.partError = std::vector<float>{floor, lamp};
    EXPECT_TRUE(writeBake(bake, out_));
    return out_;
  }
};

constexpr const char* kHeading = "of the mean squared error under all lights, where it is above 0:\n";

// Estimates of nearly no error may come out below it: that is none, and nodes that add none are not listed.
TEST_F(CertificateCli, noErrorIsBelowNone) {
  const std::string file = RELUME_SOURCE_DIR "/tests/golden/v6_cone.relume";  // has a sun of -0.0625, squared
  const ProgramResult validated = run({"validate", file}), info = run({"info", file});
  EXPECT_NE(validated.out.find("certified error 12.5 % (sky 50.0, sun 0.0, lamp 12.5)"), std::string::npos)
      << validated.out << validated.err;
  EXPECT_NE(info.out.find(std::string(kHeading) + "    100.0 % on node \"floor\", 30 receivers\nchunk"),
            std::string::npos)
      << info.out << info.err;
}

TEST_F(CertificateCli, sharesOfNodesAreOfAllThatTheyAdd) {
  const ProgramResult info = run({"info", bakeOfParts(0.1f, 0.3f)});
  EXPECT_NE(info.out.find(std::string(kHeading) + "     75.0 % on node \"lamp\", 2 receivers\n"
                                                  "     25.0 % on node \"floor\", 30 receivers\n"),
            std::string::npos)
      << info.out << info.err;
}

TEST_F(CertificateCli, nodesBelowNoErrorTakeNoShareOfTheOthers) {
  const std::string file = bakeOfParts(0.25f, -0.125f);
  for (const char* command : {"info", "validate"}) {
    const ProgramResult told = run({command, "--json", file});
    const auto parts = nlohmann::json::parse(told.out)["certificate"]["parts"];
    ASSERT_EQ(parts.size(), 2u) << told.out;
    EXPECT_EQ(parts[0]["squaredError"], 0.25);
    EXPECT_EQ(parts[0]["share"], 1.0);
    EXPECT_EQ(parts[1]["squaredError"], -0.125);
    EXPECT_EQ(parts[1]["share"], 0.0);
  }
  const ProgramResult none = run({"info", bakeOfParts(0.0f, -0.125f)});
  EXPECT_EQ(none.status, 0) << none.err;
  EXPECT_EQ(none.out.find(kHeading), std::string::npos) << none.out;
}

}  // namespace
}  // namespace relume
