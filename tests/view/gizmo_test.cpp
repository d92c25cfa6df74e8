// SPDX-License-Identifier: MIT
// Picking and dragging by a gizmo: what is grabbed stays under the mouse, and moves along its handle alone.
#include "tools/view/gizmo.h"

#include "tools/view/fly_camera.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>

#include <cmath>
#include <limits>

namespace relume {
namespace {

PixelView viewFrom(const glm::vec3& eye, const glm::vec3& target, const glm::vec2& size = {640, 400}) {
  FlyCamera camera;
  camera.position = eye;
  const glm::vec3 forward = glm::normalize(target - eye);
  camera.pitchRad = std::asin(forward.y);
  camera.yawRad = std::atan2(-forward.x, -forward.z);
  return {camera.clipFromWorld(size.x / size.y, 0.02f, 100.0f), eye, size};
}

Gizmo gizmoAt(const glm::vec3& centre, const PixelView& view) {
  Gizmo gizmo;
  gizmo.centreWorld = centre;
  gizmo.size = gizmoSize(view, centre);
  gizmo.turns = true;
  return gizmo;
}

glm::vec2 middleOf(const Gizmo& gizmo, Handle handle, const PixelView& view) {
  const std::vector<glm::vec3> outline = gizmo.outline(handle);
  if (isRing(handle)) return *view.project(outline[5]);
  glm::vec3 sum(0.0f);
  for (const glm::vec3& p : outline) sum += p;
  return *view.project(sum / static_cast<float>(outline.size()));
}

const glm::vec3 kCentre(0.5f, 1.0f, -3.0f);
const PixelView kView = viewFrom({2.0f, 2.5f, 1.0f}, kCentre);

TEST(Gizmo, raysMeetWhatPixelsShow) {
  for (const glm::vec3& p : {kCentre, glm::vec3(0, 0, -5), glm::vec3(-1, 2, -8)}) {
    const auto pixel = kView.project(p);
    ASSERT_TRUE(pixel);
    const MouseRay ray = kView.ray(*pixel);
    EXPECT_LT(glm::length(glm::cross(p - ray.origin, ray.direction)), 1e-4f);
    EXPECT_GT(glm::dot(p - ray.origin, ray.direction), 0.0f);
  }
  EXPECT_FALSE(kView.project({4.0f, 4.0f, 6.0f})) << "behind the eye";
  // A metre across the view is as many pixels as it says.
  const glm::vec3 right = glm::normalize(glm::cross(kCentre - kView.eye, glm::vec3(0, 1, 0)));
  const float pixels = glm::distance(*kView.project(kCentre + 0.01f * right), *kView.project(kCentre));
  EXPECT_NEAR(0.01f / pixels, kView.metresPerPixel(kCentre), 0.01f * kView.metresPerPixel(kCentre));
}

TEST(Gizmo, theHandleUnderAPixelIsPicked) {
  const Gizmo gizmo = gizmoAt(kCentre, kView);
  for (const Handle handle : kHandles) EXPECT_EQ(pickHandle(gizmo, kView, middleOf(gizmo, handle, kView)), handle);
  EXPECT_EQ(pickHandle(gizmo, kView, {5, 5}), Handle::none);
  Gizmo still = gizmo;
  still.moves = still.turns = false;
  for (const Handle handle : kHandles)
    EXPECT_EQ(pickHandle(still, kView, middleOf(gizmo, handle, kView)), Handle::none);
}

TEST(Gizmo, isAsLargeOnTheScreenFarAwayAsNear) {
  for (const float distance : {1.0f, 5.0f, 40.0f}) {
    const PixelView view = viewFrom({0, 0, 0}, {0, 0, -1});
    const Gizmo gizmo = gizmoAt({0, 0, -distance}, view);
    const auto outline = gizmo.outline(Handle::axisX);
    EXPECT_NEAR(glm::distance(*view.project(outline[0]), *view.project(outline[1])), 72.0f, 1.0f);
  }
}

TEST(Gizmo, anAxisMovesAlongItselfWithTheMouse) {
  const Gizmo gizmo = gizmoAt(kCentre, kView);
  for (const Handle handle : {Handle::axisX, Handle::axisY, Handle::axisZ}) {
    const glm::vec2 from = middleOf(gizmo, handle, kView);
    const auto drag = beginDrag(gizmo, handle, kView, from);
    ASSERT_TRUE(drag);
    // The mouse goes to where the grabbed point is after a move by 0.7 m.
    glm::vec3 step(0.0f);
    step[axisOf(handle)] = 0.7f;
    const glm::vec3 grabbed = kCentre + drag->grabbed;
    const auto dragged = dragTo(*drag, kView, *kView.project(grabbed + step));
    ASSERT_TRUE(dragged);
    EXPECT_LT(glm::distance(dragged->centreWorld, kCentre + step), 2e-3f);
    EXPECT_EQ(dragged->direction, gizmo.direction);
    // Beside the axis, it is still the axis that is moved along; back where it began, all is as it was.
    const auto aside = dragTo(*drag, kView, from + glm::vec2(13, 29));
    ASSERT_TRUE(aside);
    for (int c = 0; c < 3; ++c) {
      if (c == axisOf(handle)) continue;
      EXPECT_NEAR(aside->centreWorld[c], kCentre[c], 1e-6f);
    }
    EXPECT_LT(glm::distance(dragTo(*drag, kView, from)->centreWorld, kCentre), 1e-5f);
  }
}

TEST(Gizmo, aSquareMovesInItsPlaneWithTheMouse) {
  const Gizmo gizmo = gizmoAt(kCentre, kView);
  for (const Handle handle : {Handle::squareX, Handle::squareY, Handle::squareZ}) {
    const auto drag = beginDrag(gizmo, handle, kView, middleOf(gizmo, handle, kView));
    ASSERT_TRUE(drag);
    const glm::vec2 mouse = middleOf(gizmo, handle, kView) + glm::vec2(-25, 14);
    const auto dragged = dragTo(*drag, kView, mouse);
    ASSERT_TRUE(dragged);
    EXPECT_NEAR(dragged->centreWorld[axisOf(handle)], kCentre[axisOf(handle)], 1e-5f);
    const auto under = kView.project(dragged->centreWorld + drag->grabbed);
    ASSERT_TRUE(under);
    EXPECT_LT(glm::distance(*under, mouse), 0.05f);
  }
}

TEST(Gizmo, aRingTurnsByTheMousesAngle) {
  // Seen from above, a quarter of the ring about Y.
  const PixelView view = viewFrom({0.0f, 5.0f, 0.01f}, {0, 0, 0});
  Gizmo gizmo = gizmoAt({0, 0, 0}, view);
  gizmo.direction = {1, 0, 0};
  const std::vector<glm::vec3> ring = gizmo.outline(Handle::ringY);
  const auto drag = beginDrag(gizmo, Handle::ringY, view, *view.project(ring[4]));
  ASSERT_TRUE(drag);
  const auto dragged = dragTo(*drag, view, *view.project(ring[20]));
  ASSERT_TRUE(dragged);
  EXPECT_LT(glm::distance(dragged->direction, glm::vec3(0, 0, -1)), 1e-3f);
  EXPECT_NEAR(glm::length(dragged->direction), 1.0f, 1e-5f);
  EXPECT_EQ(dragged->centreWorld, gizmo.centreWorld);
}

TEST(Gizmo, handlesSeenEndOnStayWhereTheyAre) {
  const PixelView along = viewFrom({0, 0, 0}, {0, 0, -1});
  const Gizmo gizmo = gizmoAt({0, 0, -3}, along);
  const glm::vec2 centre = *along.project(gizmo.centreWorld);
  EXPECT_FALSE(beginDrag(gizmo, Handle::axisZ, along, centre));
  EXPECT_FALSE(beginDrag(gizmo, Handle::squareX, along, centre));
  EXPECT_FALSE(beginDrag(gizmo, Handle::none, along, centre));
  // A plane that the mouse leaves over its horizon
  const PixelView flat = viewFrom({0, 0.6f, 0}, {0, 0, -3});
  const Gizmo floor = gizmoAt({0, 0, -3}, flat);
  const auto drag = beginDrag(floor, Handle::squareY, flat, *flat.project(floor.centreWorld));
  ASSERT_TRUE(drag);
  EXPECT_FALSE(dragTo(*drag, flat, {320, -200}));
  EXPECT_FALSE(dragTo(*drag, flat, {320, std::numeric_limits<float>::quiet_NaN()}));
}

}  // namespace
}  // namespace relume
