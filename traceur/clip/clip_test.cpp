#include "traceur/clip/clip.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "traceur/clip/bvh.h"
#include "traceur/clip/test_clips.h"
#include "traceur/core/error.h"
#include "traceur/sim/world.h"

namespace traceur::clip {
namespace {

void expectSamePlaces(const Clip& a, const Clip& b, double metres, double radians) {
  ASSERT_EQ(a.frames.size(), b.frames.size());
  for (size_t f = 0; f < a.frames.size(); ++f) {
    const auto mine = a.places(f);
    const auto theirs = b.places(f);
    ASSERT_EQ(mine.size(), theirs.size());
    for (size_t j = 0; j < mine.size(); ++j) {
      EXPECT_LT((mine[j].p - theirs[j].p).norm(), metres) << a.joints[j].name << " " << f;
      EXPECT_LT(Eigen::AngleAxisd(mine[j].R.transpose() * theirs[j].R).angle(), radians)
          << a.joints[j].name << " " << f;
    }
  }
}

class OfRobot : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Clip, OfRobot, testing::Values("athlete", "human", "bioloid-gp", "atlas"),
                         [](const auto& i) {
                           std::string name = i.param;
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

TEST_P(OfRobot, BonesAreWhereBodiesWere) {
  const sim::Recording recording = tumbling(GetParam());
  const Clip clip = clipOf(recording);
  const auto model = sim::Model::fromMjcf(recording.mjcf);
  sim::World world(model);
  world.place(model->initialState());
  std::vector<Eigen::Matrix3d> rest;
  for (const Joint& j : clip.joints) {
    rest.push_back(world.snapshot().bodyRotation(model->body(j.name)));
  }
  for (size_t f = 0; f < clip.frames.size(); ++f) {
    world.place(recording.frames[f].state);
    const auto places = clip.places(f);
    for (size_t j = 0; j < places.size(); ++j) {
      const sim::BodyId body = model->body(clip.joints[j].name);
      EXPECT_LT((places[j].R * rest[j] - world.snapshot().bodyRotation(body)).norm(), 1e-9);
      for (const sim::Joint& hinge : model->joints()) {
        if (hinge.body != body || clip.joints[j].parent < 0) continue;
        EXPECT_LT((places[j].p - world.snapshot().jointAnchor(hinge)).norm(), 1e-9);
        break;
      }
    }
  }
}

TEST_P(OfRobot, ComesBackFromBvh) {
  const Clip clip = clipOf(tumbling(GetParam()));
  const Clip read = fromBvh(toBvh(clip), "x.bvh");
  EXPECT_NEAR(read.interval, clip.interval, 1e-9);
  // Both have the joints depth first.
  expectSamePlaces(clip, read, 1e-5, 1e-6);
}

const char* const kTwo = R"(HIERARCHY
ROOT hip
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Yrotation Xrotation Zrotation
  JOINT knee
  {
    OFFSET 0 -40 0
    CHANNELS 1 Xrotation
    End Site
    {
      OFFSET 0 -40 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.02
10 90 20 90 0 0 0
10 90 20 0 0 0 90
)";

TEST(Bvh, IsReadInTheWorldsAxes) {
  const Clip clip = fromBvh(kTwo, "two.bvh");
  ASSERT_EQ(clip.joints.size(), 2U);
  EXPECT_EQ(clip.joints[1].parent, 0);
  EXPECT_LT((clip.joints[1].tip - Vector3d(0, 0, -0.4)).norm(), 1e-12);
  // y up is our z, z forward our x, x left our y.
  EXPECT_LT((clip.places(0)[0].p - Vector3d(0.2, 0.1, 0.9)).norm(), 1e-12);
  // A quarter about up takes what looks forward to the left.
  EXPECT_LT((clip.places(0)[0].R * Vector3d::UnitX() - Vector3d::UnitY()).norm(), 1e-12);
  EXPECT_LT((clip.places(0)[1].p - Vector3d(0.2, 0.1, 0.5)).norm(), 1e-12);
  // A quarter about what is left takes what points down back… and up forward.
  EXPECT_LT((clip.places(1)[1].R * -Vector3d::UnitZ() + Vector3d::UnitX()).norm(), 1e-12);
  EXPECT_LT((fromBvh(kTwo, "two.bvh", 1).joints[1].tip - Vector3d(0, 0, -40)).norm(), 1e-12);
}

TEST(Bvh, SaysWhatIsWrongAndWhere) {
  const auto told = [](const std::string& from, const std::string& to) {
    std::string text = kTwo;
    text.replace(text.find(from), from.size(), to);
    try {
      fromBvh(text, "two.bvh");
    } catch (const InputError& e) {
      return std::string(e.what());
    }
    return std::string("read");
  };
  EXPECT_EQ(told("HIERARCHY", "hierarchy"), "two.bvh:1: expected \"HIERARCHY\", got \"hierarchy\"");
  EXPECT_EQ(told("Frames: 2", "Frames: 3"), "two.bvh:21: expected a number of motion, got the end");
  EXPECT_EQ(told("Frames: 2", "Frames: 1"), "two.bvh:20: expected the end of the file, got \"10\"");
  EXPECT_EQ(told("Frames: 2", "Frames: 900000000"),
            "two.bvh:17: expected at most 2500000 frames of 2 joints, got \"900000000\"");
  EXPECT_EQ(told("0.02", "0"),
            "two.bvh:18: expected a time between two frames of at least 0.0001 s, got \"0\"");
  EXPECT_EQ(told("1 Xrotation", "1 Wrotation"),
            "two.bvh:9: expected a channel, as Xrotation or Yposition, got \"Wrotation\"");
  EXPECT_EQ(told("-40 0\n    CH", "-40 nan\n    CH"), "two.bvh:8: expected a length, got \"nan\"");
  EXPECT_EQ(told("JOINT", "ROOT"),
            "two.bvh:6: expected \"JOINT\" or \"End Site\" in a joint, got "
            "\"ROOT\"");
  EXPECT_EQ(told("MOTION\n", ""), "two.bvh:16: expected \"MOTION\", got \"Frames:\"");
}

}  // namespace
}  // namespace traceur::clip
