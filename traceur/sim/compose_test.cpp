// Robots' files of others: whatever is in them, one robot comes out, or a sentence.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <fstream>

#include "traceur/core/test_folder.h"
#include "traceur/sim/world.h"

namespace traceur::sim {
namespace {

/// A trunk and two legs that hang on it, between two parts of a file.
std::string biped(const std::string& before = "", const std::string& world = "",
                  const std::string& after = "") {
  return "<mujoco model=\"biped\">\n" + before + "<worldbody>" + world + R"(
  <body name="torso" pos="0 0 0.4"><freejoint name="float"/>
    <geom name="torso" type="box" size="0.05 0.1 0.1" mass="3"/>
    <body name="leg_l" pos="0 0.06 -0.1"><joint name="hip_l" axis="0 1 0" range="-60 80"/>
      <geom name="leg_l" type="capsule" size="0.03" fromto="0 0 0 0 0 -0.2" mass="1"/></body>
    <body name="leg_r" pos="0 -0.06 -0.1"><joint name="hip_r" axis="0 1 0" range="-60 80"/>
      <geom name="leg_r" type="capsule" size="0.03" fromto="0 0 0 0 0 -0.2" mass="1"/></body>
  </body></worldbody>)" +
         after + "\n</mujoco>\n";
}

/// The same as URDF; `more` stands within hip_r's <joint>, `after` behind all.
std::string urdf(const std::string& hip_r = R"(type="revolute")",
                 const std::string& limit = R"(lower="-1" upper="1.5" effort="20" velocity="6")",
                 const std::string& more = "", const std::string& after = "",
                 const std::string& collision = R"(<box size="0.1 0.06 0.2"/>)") {
  const auto link = [&](const std::string& name) {
    return fmt::format(R"(<link name="{}"><inertial><mass value="1"/><inertia ixx="0.01" ixy="0"
 ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial><collision><geometry>{}</geometry></collision></link>
)",
                       name, collision);
  };
  return "<robot name=\"biped\">\n" + link("torso") + link("leg_l") + link("leg_r") + R"(
<joint name="hip_l" type="revolute"><parent link="torso"/><child link="leg_l"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1.5" effort="20" velocity="6"/></joint>
<joint name="hip_r" )" +
         hip_r + R"(><parent link="torso"/><child link="leg_r"/><axis xyz="0 1 0"/>
<limit )" +
         limit + "/>" + more + "</joint>" + after + "\n</robot>\n";
}

class FilesOfOthers : public ::testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& text) {
    const std::filesystem::path path = folder / name;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path) << text;
    return path;
  }
  std::shared_ptr<const Model> load(const std::string& name, const std::string& text,
                                    const std::string& toml = "", Scene scene = {}) {
    std::string file = write(name, text);
    if (!toml.empty()) {
      file = write(name + ".toml", "name = \"x\"\nmodel = \"" +
                                       std::filesystem::path(name).filename().string() + "\"\n" +
                                       toml);
    }
    scene.robot = std::make_shared<const Robot>(Robot::fromFile(file));
    return Model::fromScene(scene);
  }
  std::string refusal(const std::string& name, const std::string& text) {
    try {
      load(name, text);
    } catch (const InputError& e) {
      const std::string what = e.what();
      const std::string prefix = folder / "";
      return what.starts_with(prefix) ? what.substr(prefix.size()) : what;
    }
    return "accepted";
  }
  /// The contacts after a fall of a second.
  static std::vector<Contact> landed(const std::shared_ptr<const Model>& model) {
    World world(model);
    State start = model->initialState();
    world.reset(start);
    for (double t = 0; t < 1; t += model->timeStep()) {
      world.step({VectorXd::Zero(model->nu())});
    }
    return {world.snapshot().contacts().begin(), world.snapshot().contacts().end()};
  }

  TestFolder folder;
};

TEST_F(FilesOfOthers, TheirFloorSkyAndLightsGiveWayToTheScenes) {
  const auto none = load("none.xml", biped());
  const auto floor = load("floor.xml", biped(R"(<asset>
    <texture name="s" type="skybox" builtin="flat" rgb1="1 0 0" width="8" height="8"/></asset>)",
                                             R"(<light pos="0 0 3"/>
    <geom name="floor" type="plane" size="0 0 .05" friction="3" pos="0 0 .1"/>)"));
  EXPECT_EQ(floor->raw()->ngeom, none->raw()->ngeom);
  EXPECT_EQ(floor->fingerprint(), none->fingerprint());
  EXPECT_EQ(floor->mjcf().find("rgb1=\"1 0 0\""), std::string::npos);
  // In space it is theirs to keep.
  const auto kept =
      load("floor.xml", biped("", R"(<geom type="plane" size="0 0 .05"/>)"), "", {.ground = false});
  EXPECT_EQ(kept->raw()->ngeom, none->raw()->ngeom);
}

TEST_F(FilesOfOthers, NamesOfOursGiveWayToTheirs) {
  for (const char* name :
       {"ground", "traceur_props", "traceur_sun", "traceur_sky", "traceur_grid"}) {
    SCOPED_TRACE(name);
    const auto model =
        load("names.xml",
             biped(fmt::format(R"(<asset><texture name="{0}" type="2d" builtin="flat"
                                  width="8" height="8"/><material name="{0}" texture="{0}"/></asset>
                                  <custom><numeric name="{0}" data="7"/></custom>)",
                               name),
                   fmt::format(R"(<body name="b{0}"><geom name="{0}" size=".1" contype="0"
                                  conaffinity="0"/><site name="{0}"/></body>)",
                               name)),
             "", {.props = {{.name = "box", .position = {5, 0, .2}, .mass = 1}}});
    EXPECT_EQ(model->bodyName(model->root()), "torso");
    EXPECT_FALSE(model->isRobot(model->body("box")));
    EXPECT_EQ(model->joints().size(), 2u);
  }
}

TEST_F(FilesOfOthers, OnlyWhatTheirActuatorsDriveHasAMotor) {
  const auto motors = [&](const std::string& actuators, const std::string& toml = "") {
    const auto model = load("driven.xml", biped("", "", actuators), toml);
    std::string driven;
    for (const Joint& j : model->joints()) {
      if (j.motor >= 0) driven += fmt::format("{} {}, ", j.name, j.limit.torque);
    }
    return driven;
  };
  EXPECT_EQ(motors(""), "hip_l inf, hip_r inf, ");
  EXPECT_EQ(motors(R"(<actuator><motor joint="hip_r"/></actuator>)"), "hip_r inf, ");
  EXPECT_EQ(motors(R"(<actuator><motor joint="hip_r"/></actuator>)", "motors = [\"hip_l\"]"),
            "hip_l inf, ");
  // The torque is the file's: control by gain and gear, a force, a joint's own limit.
  EXPECT_EQ(motors(R"(<actuator><motor joint="hip_r" gear="-50" ctrlrange="-.4 .3"/></actuator>)"),
            "hip_r 20, ");
  EXPECT_EQ(motors(R"(<actuator><position joint="hip_r" kp="9" ctrlrange="-1 1" forcerange="-3 3"
                      gear="2"/></actuator>)"),
            "hip_r 6, ");
  EXPECT_EQ(motors(R"(<default><joint actuatorfrcrange="-8 8"/></default>)"), "hip_l 8, hip_r 8, ");
  EXPECT_EQ(motors(R"(<actuator><motor joint="hip_r" forcerange="-3 3"/>
                      <motor joint="hip_r" forcerange="-4 4"/></actuator>)"),
            "hip_r 7, ");
  // Muscles, filters, tendons' motors, sensors, keys and tuples go with the actuators.
  EXPECT_EQ(motors(R"(<tendon><fixed name="t"><joint joint="hip_l" coef="1"/></fixed></tendon>
      <actuator><muscle name="m" tendon="t" lengthrange=".1 .5"/>
        <general name="g" joint="hip_l" dyntype="filter" dynprm=".1"/>
        <intvelocity name="i" joint="hip_r" kp="1" actrange="-1 1"/></actuator>
      <sensor><actuatorfrc actuator="g"/></sensor>
      <custom><tuple name="u"><element objtype="actuator" objname="g"/></tuple></custom>
      <keyframe><key act="0 0 0" ctrl="0 0 0"/></keyframe>)"),
            "hip_l inf, hip_r inf, ");
  // A tendon's and a site's drive what they have a lever on.
  EXPECT_EQ(motors(R"(<tendon><fixed name="t"><joint joint="hip_r" coef="1"/></fixed></tendon>
      <actuator><motor tendon="t"/></actuator>)"),
            "hip_r inf, ");
}

TEST_F(FilesOfOthers, EveryShapeThatTouchesAnythingTouchesTheGround) {
  const auto other_bits =
      load("bits.xml", biped("<default><geom contype=\"2\" conaffinity=\"4\"/></default>"));
  EXPECT_FALSE(landed(other_bits).empty());
  const auto one_way =
      load("one.xml", biped("<default><geom contype=\"0\" conaffinity=\"8\"/></default>"));
  EXPECT_FALSE(landed(one_way).empty());
  EXPECT_TRUE(one_way->canTouchWorld());
  // Pairs with a floor that has given way, and shapes that are only seen.
  const std::string ghost = "<default><geom contype=\"0\" conaffinity=\"0\"/></default>";
  EXPECT_FALSE(load("ghost.xml", biped(ghost))->canTouchWorld());
  EXPECT_FALSE(load("pair.xml", biped(ghost, R"(<geom name="f" type="plane" size="0 0 1"/>)",
                                      R"(<contact><pair geom1="torso" geom2="f"/></contact>)"))
                   ->canTouchWorld());
}

TEST_F(FilesOfOthers, AnUrdfsJointsAreWhatItSays) {
  const auto limit = [&](const std::string& text) {
    const Joint j = load("r.urdf", text)->joint("hip_r");
    return fmt::format("{} {} {} {} {}", j.limit.min, j.limit.max, j.limit.torque, j.limit.speed,
                       j.motor >= 0);
  };
  EXPECT_EQ(limit(urdf()), "-1 1.5 20 6 true");
  EXPECT_EQ(limit(urdf(R"(type="continuous")")), "-inf inf 20 6 true");
  EXPECT_EQ(limit(urdf(R"(type="revolute")", R"(effort="20" velocity="6")")), "-inf inf 20 6 true");
  EXPECT_EQ(
      limit(urdf(R"(type="revolute")", R"(lower="-1e16" upper="1e16" effort="2" velocity="1")")),
      "-1e+16 1e+16 2 1 true");
  EXPECT_EQ(limit(urdf(R"(type="revolute")", R"(lower="-1" upper="1" effort="2" velocity="1")",
                       R"(<mimic joint="hip_l" multiplier="-1" offset="0.1"/>)")),
            "-1 1 2 1 false");  // it follows
  EXPECT_EQ(refusal("swapped.urdf", urdf(R"(type="revolute")", R"(lower="1" upper="-1" effort="2"
 velocity="1")")),
            "swapped.urdf:12: joint \"hip_r\": lower 1 > upper -1: expected lower < upper");
}

TEST_F(FilesOfOthers, AFollowerFollows) {
  const auto model = load("mimic.urdf",
                          urdf(R"(type="revolute")", R"(effort="2" velocity="1")",
                               R"(<mimic joint="hip_l" multiplier="-1" offset="0.1"/>)"),
                          "", {.ground = false});
  World world(model);
  Torque torque{VectorXd::Zero(model->nu())};
  torque.tau[model->joint("hip_l").motor] = 0.2;
  for (int i = 0; i < 500; ++i) world.step(torque);
  const double leader = world.state().q[model->joint("hip_l").q];
  EXPECT_GT(std::abs(leader), 0.03);
  EXPECT_NEAR(world.state().q[model->joint("hip_r").q], 0.1 - leader, 0.02);
}

TEST_F(FilesOfOthers, AnUrdfsBaseFloatsWhateverThingsAreCalled) {
  const auto floats = [&](const std::string& text) {
    const auto model = load("base.urdf", text);
    return model->rootDofs() == 6 && model->joints().size() == 2;
  };
  std::string named_root = urdf();
  for (size_t at = 0; (at = named_root.find("hip_l", at)) != std::string::npos;) {
    named_root.replace(at, 5, "root");
  }
  EXPECT_TRUE(floats(named_root));
  EXPECT_TRUE(floats(urdf(R"(type="revolute")", R"(effort="2" velocity="1")", "",
                          R"(<link name="world"/><joint name="free" type="floating">
    <parent link="world"/><child link="torso"/><limit effort="1" velocity="1"/></joint>)")));
}

TEST_F(FilesOfOthers, MassesKeepAllTheirDigits) {
  std::string text = biped();
  text.replace(text.find("mass=\"3\""), 8, "mass=\"1.23456789012\"");
  EXPECT_NEAR(load("digits.xml", text)->mass(), 3.23456789012, 1e-14);
  EXPECT_NEAR(load("digits.xml", text, "mass_scale = 1.1")->mass(), 1.1 * 3.23456789012, 1e-14);
}

// One triangle pyramid as .obj.
constexpr const char* kPyramid =
    "v 0 0 0\nv .1 0 0\nv 0 .1 0\nv 0 0 .1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
constexpr const char* kLargePyramid =
    "v 0 0 0\nv .2 0 0\nv 0 .2 0\nv 0 0 .2\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";

TEST_F(FilesOfOthers, MeshesAreThoseOfThePackageThatIsNamed) {
  write("ws/one/meshes/part.obj", kPyramid);
  write("ws/two/meshes/part.obj", kLargePyramid);
  write("ws/two/meshes/two words.obj", kLargePyramid);
  write("ws/unpacked/package.xml", "<package><name>three</name></package>");
  write("ws/unpacked/part.obj", kLargePyramid);
  const auto loads = [&](const std::string& mesh, const std::string& after = "") {
    return refusal("ws/one/urdf/r.urdf", urdf(R"(type="revolute")", R"(effort="2" velocity="1")",
                                              "", after, "<mesh filename=\"" + mesh + "\"/>"));
  };
  EXPECT_EQ(loads("package://one/meshes/part.obj"), "accepted");
  EXPECT_EQ(loads("model://two/meshes/part.obj"), "accepted");
  EXPECT_EQ(loads("package://two/meshes/two%20words.obj"), "accepted");
  EXPECT_EQ(loads(R"(package://two\meshes\part.obj)"), "accepted");
  EXPECT_EQ(loads("$(find two)/meshes/part.obj"), "accepted");
  EXPECT_EQ(loads("../meshes/part.obj"), "accepted");
  EXPECT_EQ(loads("file://" + std::string(folder / "ws/two/meshes/part.obj")), "accepted");
  EXPECT_EQ(loads("elsewhere/part.obj", "<mujoco><compiler meshdir=\"../meshes\"/></mujoco>"),
            "accepted");
  // Not the namesake of another package.
  EXPECT_EQ(loads("package://three/meshes/part.obj"),
            "ws/one/urdf/r.urdf:3: no such mesh: package://three/meshes/part.obj");
}

TEST_F(FilesOfOthers, TwoMeshesOfOneNameAreTwo) {
  write("a/part.obj", kPyramid);
  write("b/part.obj", kLargePyramid);
  std::string text = urdf(R"(type="revolute")", R"(effort="2" velocity="1")", "", "",
                          R"(<mesh filename="a/part.obj"/>)");
  const size_t last = text.rfind("a/part.obj");
  text.replace(last, 1, "b");
  const auto model = load("meshes.urdf", text);
  EXPECT_EQ(model->raw()->nmesh, 2);
}

TEST_F(FilesOfOthers, WhatIsOnlySeenNeedNotBeThere) {
  std::string text = urdf();
  text.insert(text.find("<collision>"),
              R"(<visual><geometry><mesh filename="missing.dae"/></geometry></visual>)");
  EXPECT_EQ(load("seen.urdf", text)->joints().size(), 2u);
  // What is touched must be, in a form that is read.
  write("shape.dae", "<COLLADA/>");
  const std::string touched = urdf(R"(type="revolute")", R"(effort="2" velocity="1")", "", "",
                                   R"(<mesh filename="shape.dae"/>)");
  EXPECT_NE(refusal("touched.urdf", touched).find("convert it"), std::string::npos);
}

TEST_F(FilesOfOthers, IncludesAndAssetFoldersAreReadAsTheEngineReadsThem) {
  write("meshes/part.obj", kPyramid);
  write("parts/body.xml", "<mujoco><include file=\"parts/asset.xml\"/></mujoco>");
  write("parts/asset.xml", "<mujoco><asset><mesh name=\"m\" file=\"part.obj\"/></asset></mujoco>");
  write("parts/local.xml", "<mujoco><include file=\"beside.xml\"/></mujoco>");
  write("parts/beside.xml", "<mujoco><default><joint damping=\".125\"/></default></mujoco>");
  const auto model = load("main.xml", biped(R"(<compiler meshdir="meshes"/>
    <include file="parts/body.xml"/><include file="parts/local.xml"/>)",
                                            R"(<geom type="mesh" mesh="m"/>)"));
  EXPECT_EQ(model->raw()->nmesh, 1);
  EXPECT_EQ(model->raw()->dof_damping[6], .125);
  EXPECT_EQ(refusal("strip.xml", biped(R"(<compiler meshdir="meshes" strippath="true"/>
    <asset><mesh name="m" file="elsewhere/part.obj"/></asset>)",
                                       R"(<geom type="mesh" mesh="m"/>)")),
            "accepted");
}

TEST_F(FilesOfOthers, AMistakesPlaceIsThePersonsFileAndLine) {
  EXPECT_EQ(refusal("bad.xml",
                    "<mujoco>\n<!-- of\ntwo lines -->\n<worldbody>\n\n<geom typo=\"1\"/>"
                    "</worldbody>\n</mujoco>"),
            "bad.xml:6: Schema violation: unrecognized attribute: 'typo'; Element 'geom'");
  write("part.xml", "<mujoco>\n<worldbody>\n\n\n<geom typo=\"1\"/>\n</worldbody>\n</mujoco>");
  EXPECT_EQ(refusal("main.xml", "<mujoco>\n<include file=\"part.xml\"/>\n</mujoco>"),
            "part.xml:5: Schema violation: unrecognized attribute: 'typo'; Element 'geom'");
  // What only shows when it is put together, too.
  write("part.xml",
        "<mujoco>\n<worldbody>\n\n<geom name=\"g\" type=\"box\"/>\n</worldbody>\n</mujoco>");
  EXPECT_EQ(refusal("main.xml", "<mujoco>\n<include file=\"part.xml\"/>\n</mujoco>").substr(0, 10),
            "part.xml:4");
  std::string text = urdf();
  text.replace(text.rfind("xyz=\"0 1 0\""), 11, "xyz=\"0 x 0\"");
  EXPECT_EQ(refusal("bad.urdf", text).substr(0, 12), "bad.urdf:11:") << refusal("bad.urdf", text);
}

}  // namespace
}  // namespace traceur::sim
