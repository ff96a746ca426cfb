// Scenes: what a robot's file, props and surfaces become in the document that is compiled.
#include "traceur/sim/scene.h"
#include "traceur/sim/compose.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "traceur/core/error.h"
#include "traceur/core/infinity.h"
#include "traceur/sim/model.h"
#include "traceur/sim/surface.h"
#include "traceur/sim/test_files.h"
#include "traceur/sim/world.h"

namespace traceur::sim {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::string complaint(const Scene& scene) {
  try {
    Model::fromScene(scene);
  } catch (const InputError& e) {
    return e.what();
  }
  return "accepted";
}

int geomOf(const Model& model, const char* name) {
  const int geom = mj_name2id(model.raw(), mjOBJ_GEOM, name);
  EXPECT_GE(geom, 0) << name;
  return geom;
}

template <size_t N, class T>
std::array<double, N> row(const T* numbers, int i) {
  std::array<double, N> values;
  std::copy_n(numbers + N * i, N, values.begin());
  return values;
}

TEST(Scene, AWallIsBehindItsFace) {
  for (const double yaw : {0.0, 0.7, -2.5}) {
    const Prop p = wall("w", {1, 2, 0.5}, yaw, 3, 1.5);
    EXPECT_EQ(p.name, "w");
    EXPECT_EQ(p.shape, Prop::Shape::kBox);
    EXPECT_EQ(p.mass, 0);
    EXPECT_LT((p.size - Vector3d(0.1, 1.5, 0.75)).norm(), 1e-12);
    // The middle of its face's foot, seen from its centre.
    const Vector3d foot = p.position + rotationOf(p.rpy) * Vector3d(0.1, 0, -0.75);
    EXPECT_LT((foot - Vector3d(1, 2, 0.5)).norm(), 1e-12);
    const Vector3d facing = rotationOf(p.rpy) * Vector3d::UnitX();
    EXPECT_LT((facing - Vector3d(std::cos(yaw), std::sin(yaw), 0)).norm(), 1e-12);
  }
}

TEST(Scene, ARailGoesFromOnePointToTheOther) {
  const std::pair<Vector3d, Vector3d> ends[] = {
      {{1, 2, 3}, {-2, 1, 5}}, {{0, 0, 1}, {0.5, -0.3, 0.2}}, {{0, 0, 0}, {0, 0, 2}}};
  for (const auto& [from, to] : ends) {
    const Prop p = rail("r", from, to, 0.03);
    EXPECT_EQ(p.shape, Prop::Shape::kCapsule);
    EXPECT_EQ(p.mass, 0);
    EXPECT_EQ(p.size.x(), 0.03);
    const Vector3d half = rotationOf(p.rpy) * Vector3d(0, 0, p.size.y());
    EXPECT_LT((p.position + half - to).norm(), 1e-12);
    EXPECT_LT((p.position - half - from).norm(), 1e-12);
  }
}

TEST(Scene, PropsBecomeBodies) {
  const Material soft{.friction = 0.7, .rolling = 0.01, .compliance = 0.02, .damping_ratio = 0.3};
  const Vector3d place(1, 2, 3);
  const Vector3d turn(0.3, -0.4, 0.5);
  Scene scene{.ground_material = {.friction = 0.6, .compliance = 0.006},
              .props = {{"box", Prop::Shape::kBox, {.1, .2, .3}, place, turn, 2, false, soft},
                        {"ball", Prop::Shape::kBall, {.2, 0, 0}, place, turn, 3, true, {}},
                        {"full", Prop::Shape::kBall, {.2, 0, 0}, place, turn, 3, false, {}},
                        {"bar", Prop::Shape::kCapsule, {.1, .4, 0}, place, turn, 0, false, soft}},
              .time_step = 0.002};
  scene.gravity = {0.5, -1, -7};
  const auto model = Model::fromScene(scene);
  const mjModel* m = model->raw();
  EXPECT_EQ(m->opt.timestep, 0.002);
  EXPECT_EQ(row<3>(m->opt.gravity, 0), (std::array<double, 3>{0.5, -1, -7}));
  EXPECT_EQ(m->opt.integrator, mjINT_EULER);
  const std::pair<const char*, int> types[] = {{"ground", mjGEOM_PLANE},
                                               {"box", mjGEOM_BOX},
                                               {"ball", mjGEOM_SPHERE},
                                               {"full", mjGEOM_SPHERE},
                                               {"bar", mjGEOM_CAPSULE}};
  for (const auto& [name, type] : types) {
    const int g = geomOf(*model, name);
    const bool is_soft = type == mjGEOM_BOX || type == mjGEOM_CAPSULE;
    EXPECT_EQ(m->geom_type[g], type);
    EXPECT_EQ(m->geom_contype[g], std::numeric_limits<int>::max());  // whatever a robot's bits are
    EXPECT_EQ(m->geom_conaffinity[g], std::numeric_limits<int>::max());
    EXPECT_EQ(m->geom_margin[g], 0);
    EXPECT_EQ(m->geom_gap[g], 0);
    EXPECT_EQ(m->geom_priority[g], 1);
    EXPECT_EQ(m->geom_condim[g], is_soft ? 6 : 3);
    const double friction = is_soft ? 0.7 : type == mjGEOM_PLANE ? 0.6 : 1;
    EXPECT_EQ(row<3>(m->geom_friction, g),
              (std::array<double, 3>{friction, 0.005, is_soft ? 0.01 : 0}));
    const double compliance = is_soft ? 0.02 : type == mjGEOM_PLANE ? 0.006 : 0.004;
    EXPECT_EQ(row<2>(m->geom_solref, g), (std::array<double, 2>{compliance, is_soft ? 0.3 : 1}));
    EXPECT_EQ(m->geom_solimp[mjNIMP * g], 0.95);
    if (type == mjGEOM_PLANE) continue;
    const int b = model->body(name).value;
    EXPECT_EQ(m->geom_bodyid[g], b);
    EXPECT_EQ(row<3>(m->body_pos, b), (std::array<double, 3>{1, 2, 3}));
    const Eigen::Quaterniond R(m->body_quat[4 * b], m->body_quat[4 * b + 1],
                               m->body_quat[4 * b + 2], m->body_quat[4 * b + 3]);
    EXPECT_LT(R.angularDistance(rotationOf(turn)), 1e-7);
    EXPECT_EQ(model->isStatic({b}), type == mjGEOM_CAPSULE);
    if (type != mjGEOM_CAPSULE) {
      EXPECT_GE(mj_name2id(m, mjOBJ_JOINT, name), 0);
    }
    const auto colour = row<4>(m->geom_rgba, g);
    const std::array<double, 4> expected = type == mjGEOM_CAPSULE
                                               ? std::array<double, 4>{0.62, 0.66, 0.70, 1}
                                               : std::array<double, 4>{0.85, 0.45, 0.15, 1};
    for (int i = 0; i < 4; ++i) EXPECT_NEAR(colour[i], expected[i], 1e-6);
  }
  EXPECT_EQ(row<3>(m->geom_size, geomOf(*model, "box")), (std::array<double, 3>{.1, .2, .3}));
  EXPECT_EQ(m->geom_size[3 * geomOf(*model, "ball")], .2);
  EXPECT_EQ(m->geom_size[3 * geomOf(*model, "bar")], .1);
  EXPECT_EQ(m->geom_size[3 * geomOf(*model, "bar") + 1], .4);
  EXPECT_EQ(model->bodyMass(model->body("box")), 2);
  for (const auto& [name, inertia] :
       {std::pair("ball", 2. / 3 * 3 * 0.04), {"full", 2. / 5 * 3 * 0.04}}) {
    const int b = model->body(name).value;
    EXPECT_EQ(m->body_mass[b], 3);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(m->body_inertia[3 * b + i], inertia, 1e-9) << name;
  }
  const int count = mj_name2id(m, mjOBJ_NUMERIC, kPropsName);
  ASSERT_GE(count, 0);
  EXPECT_EQ(m->numeric_data[m->numeric_adr[count]], 4);
}

TEST(Scene, WithoutAGroundThereIsNone) {
  EXPECT_EQ(mj_name2id(Model::fromScene({.ground = false})->raw(), mjOBJ_GEOM, "ground"), -1);
  EXPECT_EQ(mj_name2id(Model::fromScene({})->raw(), mjOBJ_NUMERIC, kPropsName), -1);
}

TEST(Scene, NumbersEndWhereTheySay) {
  const Prop good{.name = "p", .size = {.1, .1, .1}, .position = {1, 0, .1}, .mass = 1};
  const auto with = [&](const auto& change) {
    Prop p = good;
    change(p);
    return complaint({.props = {p}});
  };
  using Shape = Prop::Shape;
  EXPECT_EQ(with([](Prop& p) { p.mass = 0; }), "accepted");
  EXPECT_EQ(with([](Prop& p) { p.material = {.friction = 0, .compliance = 0.002}; }), "accepted");
  EXPECT_EQ(with([](Prop& p) { p.shape = Shape::kBall, p.size = {.1, 0, -1}; }), "accepted");
  EXPECT_EQ(with([](Prop& p) { p.shape = Shape::kCapsule, p.size = {.1, .1, -1}; }), "accepted");
  const std::string sizes = "scene: prop \"p\": size ";
  expectIn(with([](Prop& p) { p.size.z() = 0; }), sizes);
  expectIn(with([](Prop& p) { p.size.x() = kInfinity; }), sizes);
  expectIn(with([](Prop& p) { p.size.y() = kNan; }), sizes);
  expectIn(with([](Prop& p) { p.shape = Shape::kBall, p.size = {0, 1, 1}; }), sizes);
  expectIn(with([](Prop& p) { p.shape = Shape::kCapsule, p.size = {1, 0, 1}; }), sizes);
  expectIn(with([](Prop& p) { p.position.y() = kNan; }), "expected a finite place");
  expectIn(with([](Prop& p) { p.rpy.z() = kInfinity; }), "expected a finite place");
  expectIn(with([](Prop& p) { p.mass = kInfinity; }), "mass inf kg");
  expectIn(with([](Prop& p) { p.mass = kNan; }), "mass nan kg");
  expectIn(with([](Prop& p) { p.name = "world"; }), "has this name");
  expectIn(with([](Prop& p) { p.material.friction = -0.1; }), "friction -0.1, rolling 0");
  expectIn(with([](Prop& p) { p.material.rolling = -0.1; }), "friction 1, rolling -0.1");
  expectIn(with([](Prop& p) { p.material.compliance = 0.0019; }),
           "compliance 0.0019 s: expected at least twice the time step, 0.002 s");
  expectIn(with([](Prop& p) { p.material.damping_ratio = 0; }), "damping_ratio 0: expected");
  // The ground, where there is one; and time.
  EXPECT_EQ(complaint({.ground_material = {.compliance = 0.002}}), "accepted");
  expectIn(complaint({.ground_material = {.friction = -1}}), "scene: the ground: friction -1");
  EXPECT_EQ(complaint({.ground = false, .ground_material = {.friction = -1}}), "accepted");
  for (const double step : {0.0, -0.001, kNan}) {
    expectIn(complaint({.time_step = step}), "scene: time step ");
  }
  // Names of a robot's parts are taken, of whatever kind.
  const auto robot = robotOf(file("taken.xml", R"(<mujoco><worldbody><geom name="rock" size="1"/>
    <body name="arm"><freejoint name="root"/><geom size=".1"/><body><joint name="elbow"/>
    <geom size=".1"/></body></body><site name="mark"/></worldbody></mujoco>)"));
  for (const char* name : {"rock", "arm", "root", "elbow", "mark"}) {
    Prop p = good;
    p.name = name;
    const bool free = std::string(name) == "mark";
    EXPECT_EQ(complaint({.robot = robot, .props = {p}}) == "accepted", free) << name;
  }
}

TEST(Scene, TheGroundsSquaresAreThoseOfTheRobotsSize) {
  const auto squares = [](const std::string& published) {
    file("grid.xml",
         "<mujoco><worldbody><body name='b'><geom size='.1'/></body></worldbody></mujoco>");
    const std::string toml = "name = \"g\"\nmodel = \"grid.xml\"\n" + published;
    const std::string text = Model::fromScene({.robot = robotOf(file("grid.toml", toml))})->mjcf();
    const size_t found = text.find("texrepeat=\"");
    if (found == std::string::npos) return std::string("1 1");  // what it is unless said
    const size_t at = found + std::strlen("texrepeat=\"");
    return text.substr(at, text.find('"', at) - at);
  };
  const auto published = [](double height) {
    return fmt::format(
        "published = {{ mass = 1, height = {}, com_height = 1, joints = 1, source = \"\" }}",
        height);
  };
  EXPECT_EQ(squares(published(0.79)), "10 10");
  EXPECT_EQ(squares(published(0.8)), "1 1");
  EXPECT_EQ(squares(published(1.5)), "1 1");
  EXPECT_EQ(squares(""), "1 1");
  EXPECT_EQ(Model::fromScene({})->mjcf().find("texrepeat"), std::string::npos);
}

/// A tetrahedron as binary STL.
std::string tetrahedron() {
  const float p[4][3] = {{0, 0, 0}, {.1F, 0, 0}, {0, .1F, 0}, {0, 0, .1F}};
  const int faces[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  std::string bytes(80, ' ');
  const auto put = [&](const auto& x) {
    bytes.append(reinterpret_cast<const char*>(&x), sizeof x);
  };
  put(std::uint32_t{4});
  for (const auto& face : faces) {
    for (int i = 0; i < 3; ++i) put(0.0F);
    for (const int corner : face) {
      for (const float x : p[corner]) put(x);
    }
    put(std::uint16_t{0});
  }
  return bytes;
}

TEST(Scene, AssetsAreLookedForWhereTheFileSays) {
  const std::string stl = tetrahedron();
  for (const char* dir : {"", "a/", "a/m/", "m/"}) {
    file(fmt::format("assets/{}t.stl", dir), stl);
  }
  const auto path = [](const std::string& compilers) {
    const std::string text =
        "<mujoco>" + compilers +
        "<asset><mesh name='t' file='t.stl'/></asset><worldbody><body name='b'><freejoint/>"
        "<geom type='mesh' mesh='t'/></body></worldbody></mujoco>";
    const std::string mjcf =
        Model::fromScene({.robot = robotOf(file("assets/robot.xml", text))})->mjcf();
    EXPECT_EQ(Model::fromMjcf(mjcf)->raw()->nmesh, 1);
    const size_t end = mjcf.find("t.stl");
    const size_t folder = mjcf.rfind("assets/", end);
    return mjcf.substr(folder, end - folder);
  };
  EXPECT_EQ(path(""), "assets/");
  EXPECT_EQ(path("<compiler assetdir='a'/>"), "assets/a/");
  EXPECT_EQ(path("<compiler meshdir='m' texturedir='a'/>"), "assets/m/");
  EXPECT_EQ(path("<compiler assetdir='a' meshdir='m'/>"), "assets/m/");
  EXPECT_EQ(path("<compiler angle='radian'/><compiler meshdir='a/m'/>"), "assets/a/m/");
  // A height field's file lies among the meshes.
  const std::int32_t size[2] = {2, 2};
  const float heights[4] = {0, 1, 1, 0};
  file("assets/a/h.bin", std::string(reinterpret_cast<const char*>(size), sizeof size) +
                             std::string(reinterpret_cast<const char*>(heights), sizeof heights));
  const auto field = [](const std::string& compiler) {
    return complaint(
        {.robot = robotOf(file("assets/field.xml",
                               "<mujoco>" + compiler +
                                   "<asset><hfield name='h' file='h.bin' size='1 1 1 1'/></asset>"
                                   "<worldbody><body name='b'><geom size='.1'/></body></worldbody>"
                                   "</mujoco>"))});
  };
  EXPECT_EQ(field("<compiler meshdir='a'/>"), "accepted");
  EXPECT_EQ(field("<compiler assetdir='a'/>"), "accepted");
  expectIn(field("<compiler texturedir='a'/>"), "no such asset: ");
}

TEST(Scene, IncludesComeInTheirPlaceFromWhereTheirFileIs) {
  file("inc/parts/inner.xml",
       "<x><body name='two'><geom size='.1'/></body>"
       "<body name='three'><geom size='.1'/></body></x>");
  file("inc/parts/outer.xml", "<mujoco><include file='inner.xml'/></mujoco>");
  const auto robot = robotOf(file("inc/robot.xml", R"(<mujoco><worldbody>
    <body name="one"><geom size=".1"/></body><include file="parts/outer.xml"/>
    <body name="four"><geom size=".1"/></body></worldbody></mujoco>)"));
  const auto model = Model::fromScene({.robot = robot});
  int b = 0;
  for (const char* name : {"world", "one", "two", "three", "four"}) {
    EXPECT_EQ(model->bodyName({b++}), name);
  }
  const auto said = [](const std::string& text) {
    return complaint({.robot = robotOf(file("inc/bad.xml", text))});
  };
  expectIn(said("<mujoco>\n<include/></mujoco>"), "bad.xml:2: <include> without a file");
  file("inc/broken.xml", "<mujoco>\n\n<oh></mujoco>");
  expectIn(said("<mujoco><include file='broken.xml'/></mujoco>"), "broken.xml:3: not well-formed");
  expectIn(said(""), "not well-formed");
  expectIn(said("<!-- later -->"), "expected an element, got none");
  expectIn(said("<html/>"), "bad.xml:1: expected <mujoco> (MJCF) or <robot> (URDF), got <html>");
}

/// A link of a URDF.
std::string link(const char* name, const std::string& more = "") {
  return fmt::format(R"(<link name="{}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"
    ixy="0" ixz="0" iyz="0"/></inertial>{}</link>)",
                     name, more);
}
std::string joint(const char* name, const char* type, const char* parent, const char* child) {
  return fmt::format(
      R"(<joint name="{}" type="{}"><parent link="{}"/><child link="{}"/><axis xyz="0 1 0"/>
      <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>)",
      name, type, parent, child);
}

TEST(Scene, AUrdfBeginsAtTheLinkWithoutAParent) {
  const auto model = [](const std::string& name, const std::string& text) {
    return Model::fromScene({.robot = robotOf(file(name, "<robot name='r'>" + text + "</robot>"))});
  };
  const auto floating = model("urdf/floats.urdf", link("arm") + link("base") + link("hand") +
                                                      joint("elbow", "revolute", "arm", "hand") +
                                                      joint("shoulder", "revolute", "base", "arm"));
  EXPECT_EQ(floating->bodyName(floating->root()), "base");
  EXPECT_EQ(floating->rootDofs(), 6);
  EXPECT_EQ(floating->joints().size(), 2U);
  EXPECT_EQ(floating->nu(), 2);
  const auto bolted = model("urdf/bolted.urdf", "<link name='world'/>" + link("arm") +
                                                    joint("turn", "revolute", "world", "arm"));
  EXPECT_EQ(bolted->rootDofs(), 0);
  EXPECT_EQ(bolted->bodyName(bolted->root()), "arm");
  EXPECT_EQ(bolted->joints().size(), 1U);
  const auto said = [](const std::string& text) {
    return complaint(
        {.robot = robotOf(file("urdf/bad.urdf", "<robot name='r'>\n" + text + "</robot>"))});
  };
  expectIn(said(link("a") + link("b") + joint("1", "revolute", "a", "b") +
                joint("2", "revolute", "b", "a")),
           "bad.urdf:1: no link without a parent");
  expectIn(said(link("a") + joint("1", "nonsense", "a", "b")), "bad.urdf:");
  // Meshes: beside the file, by a scheme above it, or missing.
  file("urdf/meshes/t.stl", tetrahedron());
  const auto meshed = [&](const char* mesh) {
    return link(
        "a",
        fmt::format("<collision><geometry><mesh filename='{}'/></geometry></collision>", mesh));
  };
  for (const char* mesh :
       {"meshes/t.stl", "package://urdf/meshes/t.stl", "package://urdf/../urdf/meshes/t.stl"}) {
    EXPECT_EQ(model("urdf/mesh.urdf", meshed(mesh))->raw()->nmesh, 1) << mesh;
  }
  EXPECT_EQ(model("urdf/deep/er/mesh.urdf", meshed("package://urdf/meshes/t.stl"))->raw()->nmesh,
            1);
  for (const char* mesh : {"meshes/u.stl", "package://urdf/meshes/u.stl",
                           "package://some/meshes/t.stl", "package://urdf"}) {
    expectIn(said(meshed(mesh)), fmt::format("no such mesh: {}", mesh));
  }
}

TEST(Scene, MotorsAndLimitsAreTheRobotsOwn) {
  const std::string before =
      "<default><motor ctrlrange='-1 1' ctrllimited='true' forcerange='-1 1' "
      "forcelimited='true'/></default>";
  const std::string arms = R"(<worldbody><body name="trunk"><freejoint/><geom size=".1"/>
    <body name="x"><joint name="free" axis="0 1 0"/><geom size=".1"/></body>
    <body name="y"><joint name="held" axis="0 1 0"/><geom size=".1"/></body>
    <body name="z"><joint name="round" type="ball"/><geom size=".1"/></body>
    <body name="u"><joint axis="0 1 0"/><geom size=".1"/></body></body></worldbody>
    <worldbody><body name="v"><joint name="second" type="slide"/><geom size=".1"/></body></worldbody>
    <tendon><fixed name="cord"><joint joint="free" coef="1"/></fixed></tendon>
    <actuator><position name="own" joint="held"/><motor name="pull" tendon="cord"/>
      <motor name="inner" jointinparent="free"/></actuator>
    <sensor><actuatorfrc name="gone" actuator="own"/><actuatorfrc name="stays" actuator="pull"/>
      <jointpos name="angle" joint="held"/></sensor>)";
  for (const char* compiler : {"", "<compiler angle='radian'/>", "<compiler angle='degree'/>",
                               "<compiler angle='radian'/><compiler angle='degree'/>",
                               "<compiler angle='radian'/><compiler coordinate='local'/>"}) {
    file("motors/robot.xml", fmt::format("<mujoco>{}{}{}</mujoco>", compiler, before, arms));
    const auto robot = robotOf(file("motors/robot.toml",
                                    "name = \"m\"\nmodel = \"robot.xml\"\n[limits]\n"
                                    "held = { torque = 1, speed = 1, angle = [-0.5, 0.25] }\n"));
    const auto model = Model::fromScene({.robot = robot});
    const mjModel* m = model->raw();
    const auto range = [&](const char* name) {
      const int j = mj_name2id(m, mjOBJ_JOINT, name);
      return m->jnt_limited[j] ? row<2>(m->jnt_range, j) : std::array<double, 2>{0, 0};
    };
    EXPECT_NEAR(range("held")[0], -0.5, 1e-6) << compiler;
    EXPECT_NEAR(range("held")[1], 0.25, 1e-6) << compiler;
    EXPECT_EQ(range("free"), (std::array<double, 2>{0, 0}));
    ASSERT_EQ(m->nu, 2);  // nothing drives "second"
    for (const char* name : {"free", "held"}) {
      const int a = mj_name2id(m, mjOBJ_ACTUATOR, name);
      ASSERT_GE(a, 0) << name;
      EXPECT_EQ(m->actuator_trnid[2 * a], mj_name2id(m, mjOBJ_JOINT, name));
      EXPECT_FALSE(m->actuator_ctrllimited[a]);
      EXPECT_FALSE(m->actuator_forcelimited[a]);
      EXPECT_EQ(m->actuator_gear[6 * a], 1);
    }
    EXPECT_EQ(m->nsensor, 0);
  }
  // A limit that is none is left alone.
  Robot robot = Robot::fromFile(file("motors/robot.xml", "<mujoco>" + arms + "</mujoco>"));
  robot.limits["held"] = {1, 1, -kInfinity, kInfinity};
  const auto model = Model::fromScene({.robot = std::make_shared<const Robot>(robot)});
  EXPECT_FALSE(model->raw()->jnt_limited[mj_name2id(model->raw(), mjOBJ_JOINT, "held")]);
}

TEST(Scene, MassesAreScaledWithWhatTheyTurnWith) {
  const std::string text = R"(<mujoco><worldbody><body name="said" pos="0 0 1"><freejoint/>
    <inertial pos="0 0 0" mass="3" diaginertia="1 2 2.5"/><geom size=".1"/>
    <body name="full"><joint/><inertial pos="0 0 0" mass="2" fullinertia="1 2 2.5 .1 .2 .3"/>
    <body name="geoms"><joint/><geom type="box" size=".1 .2 .3"/></body></body></body>
    </worldbody></mujoco>)";
  file("scale/robot.xml", text);
  const auto with = [](const char* factor) {
    return Model::fromScene(
        {.robot = robotOf(
             file("scale/robot.toml",
                  std::string("name = \"s\"\nmodel = \"robot.xml\"\nmass_scale = ") + factor))});
  };
  const auto one = with("1");
  const auto more = with("2.5");
  for (int b = 1; b < 4; ++b) {
    EXPECT_NEAR(more->bodyMass({b}), 2.5 * one->bodyMass({b}), 1e-9);
    for (int i = 3 * b; i < 3 * b + 3; ++i) {
      EXPECT_NEAR(more->raw()->body_inertia[i], 2.5 * one->raw()->body_inertia[i], 1e-6) << b;
    }
  }
  EXPECT_NEAR(one->bodyMass({3}), 1000 * 8 * .1 * .2 * .3, 1e-9);
}

TEST(Surface, ThrowsBackAsItIsSaidTo) {
  // A ball that comes down with 3 m/s: how deep it goes, and how fast up again.
  const auto bounce = [](const std::string& name) {
    Scene scene;
    scene.ground_material = findSurface(name).material;
    Prop ball;
    ball.name = "ball";
    ball.shape = Prop::Shape::kBall;
    ball.size[0] = 0.1;
    ball.mass = 10;
    ball.position.z() = 0.1 + 9.0 / (2 * kGravity);
    ball.material = scene.ground_material;
    scene.props = {ball};
    World world(Model::fromScene(scene));
    world.reset(world.model().initialState());
    double deepest = 0;
    double fastest = 0;
    for (int k = 0; k < 1500; ++k) {
      world.step({});
      deepest = std::max(deepest, 0.1 - world.snapshot().q()[2]);
      fastest = std::max(fastest, world.snapshot().v()[2]);
    }
    return std::pair(deepest, fastest);
  };
  EXPECT_LT(bounce("floor").first, 0.02);
  EXPECT_LT(bounce("floor").second, 0.5);
  EXPECT_GT(bounce("gym").first, 2 * bounce("floor").first);
  EXPECT_LT(bounce("gym").second, 0.5);
  const auto trampoline = bounce("trampoline");
  EXPECT_NEAR(trampoline.first, 0.3, 0.1);
  EXPECT_NEAR(trampoline.second, 2.2, 0.3);
  EXPECT_LT(findSurface("ice").material.friction, 0.1);
  EXPECT_THROW(findSurface("ics"), InputError);
}

}  // namespace
}  // namespace traceur::sim
