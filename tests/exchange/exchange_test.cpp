// What we write for other programs, as an independent reader (Assimp) understands it.
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <gtest/gtest.h>
#include <assimp/Importer.hpp>

#include <Eigen/Geometry>
#include <map>

#include "traceur/clip/bvh.h"
#include "traceur/clip/test_clips.h"
#include "traceur/render/gltf.h"

namespace traceur {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kMillimetre = 1e-3;
constexpr double kTenthOfADegree = 0.1 * M_PI / 180;

struct Reader {
  Assimp::Importer importer;
  const aiScene* scene = nullptr;
  std::map<std::string, const aiNodeAnim*> tracks;

  Reader(const std::string& bytes, const char* kind) {
    scene = importer.ReadFileFromMemory(bytes.data(), bytes.size(), 0, kind);
    if (!scene) throw std::runtime_error(importer.GetErrorString());
    for (unsigned i = 0; i < scene->mAnimations[0]->mNumChannels; ++i) {
      const aiNodeAnim* a = scene->mAnimations[0]->mChannels[i];
      tracks[a->mNodeName.C_Str()] = a;
    }
  }
  /// The node in the file's world at a frame.
  Eigen::Affine3d place(const aiNode* node, unsigned frame) const {
    aiMatrix4x4 m = node->mTransformation;
    if (const auto found = tracks.find(node->mName.C_Str()); found != tracks.end()) {
      const aiNodeAnim* a = found->second;
      aiVector3D scaling;
      aiVector3D p;
      aiQuaternion q;
      m.Decompose(scaling, q, p);
      const auto at = [&](unsigned n) { return std::min(frame, n - 1); };
      if (a->mNumPositionKeys) p = a->mPositionKeys[at(a->mNumPositionKeys)].mValue;
      if (a->mNumRotationKeys) q = a->mRotationKeys[at(a->mNumRotationKeys)].mValue;
      m = aiMatrix4x4(aiVector3D(1, 1, 1), q, p);
    }
    Eigen::Affine3d mine;
    for (int i = 0; i < 4; ++i) {
      for (int k = 0; k < 4; ++k) mine.matrix()(i, k) = m[i][k];
    }
    return node->mParent ? place(node->mParent, frame) * mine : mine;
  }
};

/// From a file's axes: x left, y up, z forward.
Matrix3d axes() {
  return (Matrix3d() << 0, 0, 1, 1, 0, 0, 0, 1, 0).finished();
}

class Exchange : public testing::TestWithParam<const char*> {
 protected:
  sim::Recording recording = clip::tumbling(GetParam());
  std::shared_ptr<const sim::Model> model = sim::Model::fromMjcf(recording.mjcf);
  sim::World world{model};
};
INSTANTIATE_TEST_SUITE_P(Robots, Exchange, testing::Values("athlete", "atlas"));

TEST_P(Exchange, AnotherProgramReadsTheSkeleton) {
  const clip::Clip clip = clip::clipOf(recording);
  const Reader reader(clip::toBvh(clip), "bvh");
  EXPECT_NEAR(1 / reader.scene->mAnimations[0]->mTicksPerSecond, clip.interval, 1e-9);
  for (unsigned f = 0; f < clip.frames.size(); ++f) {
    const auto places = clip.places(f);
    for (size_t j = 0; j < places.size(); ++j) {
      const aiNode* node = reader.scene->mRootNode->FindNode(clip.joints[j].name.c_str());
      ASSERT_TRUE(node) << clip.joints[j].name;
      const Eigen::Affine3d theirs = reader.place(node, f);
      EXPECT_LT((axes() * theirs.translation() / 100 - places[j].p).norm(), kMillimetre)
          << clip.joints[j].name << " " << f;
      const Matrix3d R = axes() * theirs.rotation() * axes().transpose();
      EXPECT_LT(Eigen::AngleAxisd(R.transpose() * places[j].R).angle(), kTenthOfADegree)
          << clip.joints[j].name << " " << f;
    }
  }
}

TEST_P(Exchange, AnotherProgramReadsTheScene) {
  const Reader reader(render::toGlb(recording), "glb");
  unsigned triangles = 0;
  for (unsigned i = 0; i < reader.scene->mNumMeshes; ++i) {
    triangles += reader.scene->mMeshes[i]->mNumFaces;
  }
  EXPECT_GT(triangles, 1000U);
  for (unsigned f = 0; f < recording.frames.size(); ++f) {
    world.place(recording.frames[f].state);
    for (int b = 0; b < model->bodies(); ++b) {
      if (!model->isRobot({b})) continue;
      const aiNode* node = reader.scene->mRootNode->FindNode(model->bodyName({b}).c_str());
      ASSERT_TRUE(node) << model->bodyName({b});
      const Eigen::Affine3d theirs = reader.place(node, f);
      EXPECT_LT((axes() * theirs.translation() - world.snapshot().bodyPosition({b})).norm(),
                kMillimetre);
      EXPECT_LT(Eigen::AngleAxisd((axes() * theirs.rotation()).transpose() *
                                  world.snapshot().bodyRotation({b}))
                    .angle(),
                kTenthOfADegree);
    }
  }
}

TEST(ExchangedNames, MayBeAnyBytes) {
  sim::Recording one;
  one.mjcf =
      "<mujoco><worldbody><body name=\"a\xff\"><freejoint/><geom size=\"0.1\"/></body>"
      "</worldbody></mujoco>";
  const auto model = sim::Model::fromMjcf(one.mjcf);
  sim::World world(model);
  one.frames.push_back(sim::frameOf(world.snapshot(), 0, Eigen::VectorXd(0)));
  Assimp::Importer importer;
  const std::string bytes = render::toGlb(one);
  const aiScene* scene = importer.ReadFileFromMemory(bytes.data(), bytes.size(), 0, "glb");
  ASSERT_TRUE(scene) << importer.GetErrorString();
  EXPECT_EQ(scene->mNumMeshes, 1U);
}

TEST(ExchangedShapes, ReachAsFarAsTheyDo) {
  sim::Recording one;
  one.mjcf = R"(<mujoco><worldbody>
    <body name="a" pos="1 2 3"><freejoint/>
      <geom type="capsule" size="0.1 0.3" pos="0 0 0.2" rgba="1 0 0 1"/>
      <geom type="box" size="0.1 0.2 0.3" euler="0 0 90"/>
      <geom type="cylinder" size="0.05 0.5"/>
      <geom type="ellipsoid" size="0.4 0.1 0.1"/>
      <geom type="sphere" size="0.25" group="3"/></body></worldbody></mujoco>)";
  const auto model = sim::Model::fromMjcf(one.mjcf);
  sim::World world(model);
  one.frames.push_back(sim::frameOf(world.snapshot(), 0, Eigen::VectorXd(0)));
  Assimp::Importer importer;
  const std::string bytes = render::toGlb(one);
  const aiScene* scene = importer.ReadFileFromMemory(bytes.data(), bytes.size(),
                                                     aiProcess_ValidateDataStructure, "glb");
  ASSERT_TRUE(scene) << importer.GetErrorString();
  ASSERT_EQ(scene->mNumMeshes, 4U);  // group 3 is not shown
  const Vector3d reach[] = {{0.1, 0.1, 0.6}, {0.2, 0.1, 0.3}, {0.05, 0.05, 0.5}, {0.4, 0.1, 0.1}};
  for (unsigned i = 0; i < 4; ++i) {
    const aiMesh* mesh = scene->mMeshes[i];
    Vector3d most = Vector3d::Zero();
    double volume = 0;
    for (unsigned f = 0; f < mesh->mNumFaces; ++f) {
      Vector3d corner[3];
      Vector3d normal = Vector3d::Zero();
      for (int k = 0; k < 3; ++k) {
        const unsigned at = mesh->mFaces[f].mIndices[k];
        const aiVector3D& v = mesh->mVertices[at];
        const aiVector3D& n = mesh->mNormals[at];
        corner[k] = {v.x, v.y, v.z};
        normal += Vector3d(n.x, n.y, n.z);
        most = most.cwiseMax(corner[k]);
      }
      const Vector3d area = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
      EXPECT_GE(area.dot(normal), -1e-12) << i;  // out, as the corners go round
      volume += corner[0].dot(corner[1].cross(corner[2])) / 6;
    }
    EXPECT_LT((most - reach[i]).norm(), 1e-6) << i;
    EXPECT_GT(volume, 0) << i;
  }
  // A closed box holds what it holds.
  const double box = 8 * 0.1 * 0.2 * 0.3;
  const aiMesh* mesh = scene->mMeshes[1];
  double volume = 0;
  for (unsigned f = 0; f < mesh->mNumFaces; ++f) {
    Vector3d c[3];
    for (int k = 0; k < 3; ++k) {
      const aiVector3D& v = mesh->mVertices[mesh->mFaces[f].mIndices[k]];
      c[k] = {v.x, v.y, v.z};
    }
    volume += c[0].dot(c[1].cross(c[2])) / 6;
  }
  EXPECT_NEAR(volume, box, 1e-6);
}

}  // namespace
}  // namespace traceur
