// SPDX-License-Identifier: MIT
// --edit: static objects of a baked level are moved in the viewer, and light near them is corrected by live light.
#include "tests/view/session_fixture.h"
#include "tools/compare/find_edits.h"
#include "tools/images/image_diff.h"
#include "tools/render/move_nodes.h"
#include "tools/render/render_cpu.h"

#include <cstddef>
#include <vector>

namespace relume {
namespace {

using namespace test;

class EditSession : public ViewerSession {
 protected:
  void SetUp() override {
    ViewerSession::SetUp();
    options_.edit = true;
    options_.camera = "cam_hall";
    options_.live = {16, 32, 2};
    writeBakeFile(small(2000));
    auto state = initialState(scene(), options_);
    ASSERT_TRUE(state) << state.error().message;
    session_.emplace(std::move(*state), options_, EglContext::getProcAddress);
    LevelFiles files{kLevel, at("level.relume"), {}};
    files.isEditable = true;
    session_->begin(std::move(files));
    session_->state.liveStep = 1.0 / 15.0;
    ASSERT_TRUE(frames([&] { return session_->level != nullptr; }));
  }
  ViewedObject& object(const std::string& name) {
    auto& objects = session_->state.objects;
    return *std::find_if(objects.begin(), objects.end(), [&](const ViewedObject& o) { return o.name == name; });
  }
  void sinkWalls(float by) {
    for (const char* wall : {"living_wall_east", "hall_wall_west"})
      object(wall).position = object(wall).home + glm::vec3(0, by, 0);
  }
  std::vector<glm::vec3> links() {
    ViewState state = session_->state;
    state.direct = false;
    return *session_->viewer->irradiance(state, kWidth, kHeight);
  }
  static double greenOf(const std::vector<glm::vec3>& pixels) {
    double sum = 0.0;
    for (const glm::vec3& p : pixels) sum += static_cast<double>(p.g);
    return sum / static_cast<double>(pixels.size());
  }
};

// The lamp's room and the dark hall, between which the walls sink: as `relume render --edited-from` has it, and the
// bake's light to the bit once they are back.
TEST_F(EditSession, lightFollowsWallsOfABakedLevel) {
  for (int i = 0; i < 20; ++i) frame();
  const std::vector<glm::vec3> baked = links();
  EXPECT_EQ(session_->viewer->editedObjects(session_->state), 0u);
  EXPECT_GT(session_->state.objects.size(), 20u) << "walls as well";

  sinkWalls(-2.0f);
  for (int i = 0; i < 60; ++i) frame();
  EXPECT_EQ(session_->viewer->editedObjects(session_->state), 2u);
  const std::vector<glm::vec3> shown = links();
  bool isHeld = false;
  for (const auto& [name, bytes] : session_->viewer->memory()) isHeld = isHeld || name.find("before the edit") == 0;
  EXPECT_TRUE(isHeld);

  // The same by the command's renderer
  const Scene before = scene();
  Scene now = before;
  ASSERT_TRUE(moveNodes({"living_wall_east=0,-2,0", "hall_wall_west=0,-2,0"}, MovedParts::all, now));
  FoundEdits edits = findEdits(before, now);
  edits.level.live.cells = options_.live.cells;
  RenderRequest request;
  request.bake = &session_->level->bake;
  request.edited = &edits.level;
  request.camera =
      *std::find_if(now.cameras.begin(), now.cameras.end(), [](const Camera& c) { return c.name == "cam_hall"; });
  for (const SceneLight& light : now.lights) {
    if (light.name == "lamp") request.lights.push_back(light);
  }
  request.width = kWidth;
  request.height = kHeight;
  request.samples = 1;
  const auto draw = [&] {
    Context context;
    auto tracer = RayTracer::create(now, "", context, RayStructure::thorough, RayGeometry::drawn);
    EXPECT_TRUE(tracer);
    const auto drawn = renderCpu(*tracer, request, context);
    EXPECT_TRUE(drawn);
    return composeAov(*drawn, Aov::indirect);
  };
  const std::vector<glm::vec3> expected = draw();
  request.edited = nullptr;
  const std::vector<glm::vec3> stale = draw();
  // Edges are another sample's. At hand 19 %; links alone, under lights that reach through the gap, differ by 46 %.
  const auto byWindow = comparePictures({kWidth, kHeight, shown}, {kWidth, kHeight, expected}, 1.0f, "shown", "drawn");
  const auto byLinks = comparePictures({kWidth, kHeight, stale}, {kWidth, kHeight, expected}, 1.0f, "links", "drawn");
  ASSERT_TRUE(byWindow && byLinks);
  EXPECT_GT(byLinks->relativeRmse, 0.3) << "the test's edit changes next to nothing";
  EXPECT_NEAR(byWindow->energy, 1.0, 0.1);
  EXPECT_LT(byWindow->relativeRmse, 0.5 * byLinks->relativeRmse);

  sinkWalls(0.0f);
  for (int i = 0; i < 20; ++i) frame();
  EXPECT_EQ(session_->viewer->editedObjects(session_->state), 0u);
  EXPECT_FALSE(session_->viewer->awaitsEdits());
  const std::vector<glm::vec3> back = links();
  EXPECT_NEAR(greenOf(back), greenOf(baked), 1e-3 * greenOf(baked));
}

// A click takes hold of what stands, and the CPU's light has its shadow where it was dragged to.
TEST_F(EditSession, objectsThatStandArePickedAndCastShadowsByTheCpu) {
  frame();
  session_->press({0.5f * kWidth, 0.8f * kHeight});
  session_->release();
  frame();
  EXPECT_TRUE(session_->objects.selected().has_value());

  sinkWalls(-2.0f);
  for (int i = 0; i < 30; ++i) frame();
  const double byGl = greenOf(links());
  session_->state.relightBy.backend = BackendKind::cpu;
  for (int i = 0; i < 30; ++i) frame();
  EXPECT_NEAR(greenOf(links()), byGl, 0.05 * byGl);
}

}  // namespace
}  // namespace relume
