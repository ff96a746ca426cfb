#include "traceur/render/offscreen.h"

#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "traceur/core/error.h"
#include "traceur/render/gl_context.h"
#include "traceur/sim/engine.h"

namespace traceur::render {
namespace {

constexpr int kLeastSide = 16;
constexpr int kMostSide = 8192;      // OSMesa allows twice this
constexpr int kMostGeoms = 2000;     // of a scene, decoration included
constexpr double kFieldOfView = 30;  // vertical [deg]; long lens, little distortion [ours]
constexpr double kFill = 0.80;       // of the picture's sides the robot may take [ours]
constexpr double kNear = 3;  // sizes; a prop farther from the robot may leave the picture [ours]
constexpr double kFollowTime = 0.15;  // standard deviation of the follower's Gaussian [s] [ours]
constexpr int kPasses = 9;            // drawings of Quality::kFine [ours]
constexpr double kSunRadius =
    0.035;  // half angle of the light that makes soft shadows [rad] [ours]
constexpr double kLeastForce = 0.01;      // of the robot's weight, to be drawn [ours]
constexpr Color kForceColor{0, 90, 181};  // dark blue: stands out from any warm robot colour [ours]

constexpr double kDegree = std::numbers::pi / 180;

/// The direction of looking as MuJoCo's cameras have it: azimuth from +x towards +y, elevation
/// above the horizon [deg].
struct Direction {
  double azimuth = 0;
  double elevation = 0;
};

Direction directionOf(View view) {
  switch (view) {
    case View::kSide:
      return {90, -8};
    case View::kThreeQuarter:
      return {130, -14};
    case View::kFront:
      return {180, -10};
  }
  return {};
}

/// Three unit vectors in world axes. A camera's: to the right, up, forward.
using Axes = std::array<Vector3d, 3>;

Axes axesOf(View view) {
  const Direction direction = directionOf(view);
  const double a = direction.azimuth * kDegree;
  const double e = direction.elevation * kDegree;
  const Vector3d forward(std::cos(a) * std::cos(e), std::sin(a) * std::cos(e), std::sin(e));
  const Vector3d right(std::sin(a), -std::cos(a), 0);
  return {right, right.cross(forward), forward};
}

const Axes kWorldAxes = {Vector3d::UnitX(), Vector3d::UnitY(), Vector3d::UnitZ()};

/// Extents along three axes [m]; empty until something widens it.
struct Box {
  Vector3d low = Vector3d::Constant(std::numeric_limits<double>::infinity());
  Vector3d high = -low;
  Vector3d middle() const { return (low + high) / 2; }
  void include(const Box& other) {
    low = low.cwiseMin(other.low);
    high = high.cwiseMax(other.high);
  }
};

/// Half the extent of a geom along a unit vector given in the geom's axes [m].
double halfExtent(const mjModel* m, int geom, const Vector3d& d) {
  const mjtNum* s = m->geom_size + size_t{3} * geom;
  switch (m->geom_type[geom]) {
    case mjGEOM_BOX:
      return s[0] * std::abs(d.x()) + s[1] * std::abs(d.y()) + s[2] * std::abs(d.z());
    case mjGEOM_CAPSULE:
      return s[0] + s[1] * std::abs(d.z());
    case mjGEOM_CYLINDER:
      return s[0] * std::hypot(d.x(), d.y()) + s[1] * std::abs(d.z());
    case mjGEOM_ELLIPSOID:
      return std::hypot(s[0] * d.x(), s[1] * d.y(), s[2] * d.z());
    default:
      return m->geom_rbound[geom];  // exact for a ball; 0 for a plane
  }
}

/// The force on one robot body: where its contacts are in the mean, and their sum.
struct BodyForce {
  Vector3d weighted = Vector3d::Zero();  // Σ |f| p
  double weight = 0;                     // Σ |f| [N]
  Vector3d force = Vector3d::Zero();     // [N]
};

void drawArrow(Image& image, const Vector2d& from, const Vector2d& to, double half_width,
               Color color) {
  const double length = (to - from).norm();
  if (length < 1) return;
  const Vector2d along = (to - from) / length;
  const Vector2d across(-along.y(), along.x());
  const double head = std::min(5 * half_width, length);
  const Vector2d neck = to - head * along;
  // A white rim first, so that the arrow is seen on any colour.
  for (const double rim : {std::max(1.0, 0.5 * half_width), 0.0}) {
    const double w = half_width + rim;
    const double h = 2.6 * half_width + 1.6 * rim;
    const Vector2d corners[] = {from - rim * along - w * across, neck - w * across,
                                neck - rim * along - h * across, to + 2.0 * rim * along,
                                neck - rim * along + h * across, neck + w * across,
                                from - rim * along + w * across};
    fillPolygon(image, corners, rim > 0 ? kWhite : color);
  }
}

/// The usual sign for a centre of mass: a disc in quarters.
void drawComMark(Image& image, const Vector2d& p, double radius) {
  fillDisc(image, p, radius + std::max(1.0, radius / 5), kInk);
  fillDisc(image, p, radius, kWhite);
  for (const double sign : {1.0, -1.0}) {
    std::vector<Vector2d> quarter = {p};
    for (int k = 0; k <= 12; ++k) {
      const double a = k * std::numbers::pi / 24;
      quarter.push_back(p + sign * radius * Vector2d(std::cos(a), std::sin(a)));
    }
    fillPolygon(image, quarter, kInk);
  }
}

}  // namespace

struct Offscreen::State {
  State(std::shared_ptr<const sim::Model> model_in, const OffscreenOptions& options_in);
  ~State();

  void pose(const sim::Frame& frame);
  /// The robot as posed, along some axes from a point. The point of origin for an empty world.
  Box geomBox(int geom, const Axes& axes, const Vector3d& from) const;
  Box robotBox(const Axes& axes, const Vector3d& from = Vector3d::Zero()) const;
  Box subjectBox(const Axes& axes, const Vector3d& from = Vector3d::Zero()) const;
  std::vector<Camera> aim(std::span<const sim::Frame> motion, const Camera& camera);
  double distanceFor(const Box& box) const;
  Image render(const Camera& camera);
  void shiftRaster(double x, double y);
  void shiftSun(const Vector3d& look_at, double x, double y);
  void overlay(const sim::Frame& frame, const Camera& camera, const DrawOptions& draw,
               Image& image) const;
  Vector2d project(const Camera& camera, const Vector3d& p) const;

  std::shared_ptr<const sim::Model> model;
  OffscreenOptions options;
  GlContext gl;
  mjModel* m = nullptr;  // with all that is only seen; what concerns pictures is changed in it
  mjData* d = nullptr;
  mjvScene scene;
  mjrContext context;
  mjvOption show;
  std::vector<int> robot_geoms;  // all geoms where there is no robot
  std::vector<int> prop_geoms;   // of bodies that move beside the robot: a ball
  double size = 1;               // of the robot [m]
  std::vector<std::uint8_t> pixels;
};

Offscreen::State::State(std::shared_ptr<const sim::Model> model_in,
                        const OffscreenOptions& options_in)
    : model(std::move(model_in)), options(options_in) {
  std::string error;
  m = sim::compileText(model->mjcf(), error).release();
  if (!m) throw InputError(fmt::format("the scene cannot be drawn: {}", error));
  d = mj_makeData(m);
  mjv_defaultOption(&show);
  std::vector<int> all_geoms;
  for (int g = 0; g < m->ngeom; ++g) {
    const bool visible = m->geom_group[g] < mjNGROUP && show.geomgroup[m->geom_group[g]];
    if (!visible || m->geom_type[g] == mjGEOM_PLANE) continue;
    all_geoms.push_back(g);
    const sim::BodyId body{m->geom_bodyid[g]};
    if (model->isRobot(body)) {
      robot_geoms.push_back(g);
    } else if (!model->isStatic(body)) {
      prop_geoms.push_back(g);
    }
  }
  if (robot_geoms.empty()) robot_geoms = all_geoms;
  mj_kinematics(m, d);
  const Box box = robotBox(kWorldAxes);
  size = robot_geoms.empty() ? m->stat.extent : (box.high - box.low).maxCoeff();

  // To contacts every plane is infinite; a size would only end the ground before the horizon.
  for (int g = 0; g < m->ngeom; ++g) {
    if (m->geom_type[g] == mjGEOM_PLANE) std::fill_n(m->geom_size + size_t{3} * g, 2, 0);
  }
  const bool fine = options.quality == Quality::kFine;
  m->vis.global.offwidth = options.width;
  m->vis.global.offheight = options.height;
  m->vis.global.fovy = kFieldOfView;
  m->vis.quality.offsamples = fine ? 0 : 4;
  m->vis.quality.shadowsize = fine ? 1024 : 2048;
  // Round enough for the size; half the time of a small picture goes into vertices.
  m->vis.quality.numslices = std::clamp(options.height / (fine ? 12 : 18), 16, 32);
  m->vis.quality.numstacks = m->vis.quality.numslices / 2;
  m->vis.quality.numquads = 2;
  // Distances below are in extents: of the robot, not of the scene, so that a far prop changes
  // neither the sharpness of the shadow nor the fog.
  m->stat.extent = size;
  m->vis.map.znear = 0.05F;
  m->vis.map.zfar = 200;
  m->vis.map.shadowclip = 1.7F;
  m->vis.map.fogstart = 5;
  m->vis.map.fogend = 18;

  mjv_defaultScene(&scene);
  mjv_makeScene(m, &scene, kMostGeoms);
  const float* fog = m->vis.rgba.fog;
  scene.flags[mjRND_SHADOW] = 1;
  scene.flags[mjRND_REFLECTION] = 0;  // a whole drawing more
  scene.flags[mjRND_HAZE] = 0;
  scene.flags[mjRND_FOG] = fog[0] + fog[1] + fog[2] > 0;  // black is MuJoCo's default: none chosen
  mjr_defaultContext(&context);
  mjr_makeContext(m, &context, mjFONTSCALE_100);
  mjr_setBuffer(mjFB_OFFSCREEN, &context);
  pixels.resize(size_t{3} * options.width * options.height);
}

Offscreen::State::~State() {
  gl.makeCurrent();
  mjr_freeContext(&context);
  mjv_freeScene(&scene);
  mj_deleteData(d);
  mj_deleteModel(m);
}

void Offscreen::State::pose(const sim::Frame& frame) {
  if (frame.state.q.size() != m->nq) {
    throw InputError(fmt::format("cannot draw a frame of another model: expected q({}), got q({})",
                                 m->nq, frame.state.q.size()));
  }
  if (!frame.state.q.allFinite()) throw InputError("cannot draw a frame whose q holds NaN");
  std::copy_n(frame.state.q.data(), m->nq, d->qpos);
  mj_kinematics(m, d);
  mj_comPos(m, d);
  mj_camlight(m, d);
  mj_tendon(m, d);
}

Box Offscreen::State::geomBox(int geom, const Axes& axes, const Vector3d& from) const {
  const Eigen::Map<const Vector3d> centre(d->geom_xpos + size_t{3} * geom);
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R(d->geom_xmat +
                                                                         size_t{9} * geom);
  Box box;
  for (int k = 0; k < 3; ++k) {
    const double middle = axes[k].dot(centre - from);
    const double half = halfExtent(m, geom, R.transpose() * axes[k]);
    box.low[k] = middle - half;
    box.high[k] = middle + half;
  }
  return box;
}

Box Offscreen::State::robotBox(const Axes& axes, const Vector3d& from) const {
  if (robot_geoms.empty()) return {-from, -from};
  Box box;
  for (const int g : robot_geoms) box.include(geomBox(g, axes, from));
  return box;
}

/// Around the robot and the props near it.
Box Offscreen::State::subjectBox(const Axes& axes, const Vector3d& from) const {
  Box box = robotBox(axes, from);
  const Vector3d robot = box.middle();
  for (const int g : prop_geoms) {
    const Box prop = geomBox(g, axes, from);
    if ((prop.middle() - robot).norm() < kNear * size) box.include(prop);
  }
  return box;
}

double Offscreen::State::distanceFor(const Box& box) const {
  const double slope_up = kFill * std::tan(kFieldOfView / 2 * kDegree);
  const double slope_right = slope_up * options.width / options.height;
  const Vector3d reach = box.low.cwiseAbs().cwiseMax(box.high.cwiseAbs());
  // What is nearest to the viewer looks largest.
  return std::max({reach.x() / slope_right, reach.y() / slope_up, size / 2}) +
         std::max(0.0, -box.low.z());
}

std::vector<Camera> Offscreen::State::aim(std::span<const sim::Frame> motion,
                                          const Camera& camera) {
  std::vector<Camera> cameras(motion.size(), camera);
  if (!camera.look_at) {
    std::vector<Vector3d> com;  // moved as far as props move the middle
    std::vector<Box> boxes;
    Box whole;
    for (const sim::Frame& frame : motion) {
      pose(frame);
      com.emplace_back(Eigen::Map<const Vector3d>(d->subtree_com +
                                                  size_t{3} * std::max(0, model->root().value)));
      boxes.push_back(subjectBox(kWorldAxes));
      if (!prop_geoms.empty()) com.back() += boxes.back().middle() - robotBox(kWorldAxes).middle();
      whole.include(boxes.back());
    }
    // Slow enough to be smooth, fast enough to keep a falling robot in the picture.
    double speed = 0;
    for (size_t i = 1; i < motion.size(); ++i) {
      const double dt = motion[i].state.time - motion[i - 1].state.time;
      if (dt > 0) speed = std::max(speed, (com[i] - com[i - 1]).norm() / dt);
    }
    const double sigma = speed > 0 ? std::min(kFollowTime, size / speed) : kFollowTime;
    const bool follow_up = whole.high.z() - whole.low.z() > 2 * size;
    for (size_t i = 0; i < motion.size(); ++i) {
      if (!camera.follow) {
        cameras[i].look_at = whole.middle();
        continue;
      }
      // A straight line fitted to the neighbours, weighted by a Gaussian: unlike a weighted mean it
      // does not lag behind at the ends.
      double w0 = 0, w1 = 0, w2 = 0;  // Σ w, Σ w t, Σ w t²
      Vector3d x0 = Vector3d::Zero(), x1 = Vector3d::Zero();
      const auto add = [&](size_t k) {
        const double t = (motion[k].state.time - motion[i].state.time) / sigma;
        if (std::abs(t) > 3) return false;
        const double w = std::exp(-t * t / 2);
        const Vector3d x(com[k].x(), com[k].y(), boxes[k].middle().z());
        w0 += w;
        w1 += w * t;
        w2 += w * t * t;
        x0 += w * x;
        x1 += w * t * x;
        return true;
      };
      for (size_t k = i; k < motion.size() && add(k); ++k) {
      }
      for (size_t k = i; k-- > 0 && add(k);) {
      }
      const double determinant = w0 * w2 - w1 * w1;
      Vector3d at = determinant > 1e-6 ? Vector3d((w2 * x0 - w1 * x1) / determinant) : x0 / w0;
      if (!follow_up) at.z() = whole.middle().z();
      cameras[i].look_at = at;
    }
  }
  if (camera.distance <= 0) {
    const Axes axes = axesOf(camera.view);
    double distance = 0;
    for (size_t i = 0; i < motion.size(); ++i) {
      pose(motion[i]);
      distance = std::max(distance, distanceFor(subjectBox(axes, *cameras[i].look_at)));
    }
    for (Camera& c : cameras) c.distance = distance;
  }
  return cameras;
}

void Offscreen::State::shiftRaster(double x, double y) {
  for (mjvGLCamera& eye : scene.camera) {
    const float pixel = (eye.frustum_top - eye.frustum_bottom) / static_cast<float>(options.height);
    eye.frustum_center += static_cast<float>(x) * pixel;
    eye.frustum_bottom += static_cast<float>(y) * pixel;
    eye.frustum_top += static_cast<float>(y) * pixel;
  }
}

void Offscreen::State::shiftSun(const Vector3d& look_at, double x, double y) {
  for (int i = 0; i < scene.nlight; ++i) {
    mjvLight& light = scene.lights[i];
    if (light.headlight || !light.castshadow || light.type != mjLIGHT_DIRECTIONAL) continue;
    const Vector3d forward = Eigen::Map<Eigen::Vector3f>(light.dir).cast<double>().normalized();
    const Vector3d right = forward.unitOrthogonal();
    const Vector3d shifted =
        (forward + kSunRadius * (x * right + y * forward.cross(right))).normalized();
    // The shadow map is a square around the light's axis: keep what we look at on it.
    Eigen::Map<Eigen::Vector3f>(light.dir) = shifted.cast<float>();
    Eigen::Map<Eigen::Vector3f>(light.pos) = (look_at - 4 * size * shifted).cast<float>();
  }
}

Image Offscreen::State::render(const Camera& camera) {
  gl.makeCurrent();
  mjvCamera view;
  mjv_defaultCamera(&view);
  const Direction direction = directionOf(camera.view);
  view.azimuth = direction.azimuth;
  view.elevation = direction.elevation;
  view.distance = camera.distance;
  std::copy_n(camera.look_at->data(), 3, view.lookat);
  // The scene's endless ground is laid out about where its camera was last.
  mjv_updateCamera(m, d, &view, &scene);

  const bool fine = options.quality == Quality::kFine;
  const int passes = fine ? kPasses : 1;
  const mjrRect viewport = {0, 0, options.width, options.height};
  std::vector<std::uint16_t> sum(pixels.size());
  for (int k = 0; k < passes; ++k) {
    mjv_updateScene(m, d, &show, nullptr, &view, mjCAT_ALL, &scene);
    double sun_x = 0;
    double sun_y = 0;
    if (fine) {
      // A lattice for the raster (each of 9 columns and of 9 rows once), a spiral for the sun.
      shiftRaster((k + 0.5) / passes - 0.5, (k * 4 % passes + 0.5) / passes - 0.5);
      const double r = std::sqrt((k + 0.5) / passes);
      const double angle = k * std::numbers::pi * (3 - std::sqrt(5.0));
      sun_x = r * std::cos(angle);
      sun_y = r * std::sin(angle);
    }
    shiftSun(*camera.look_at, sun_x, sun_y);
    mjr_render(viewport, &scene, &context);
    mjr_readPixels(pixels.data(), nullptr, viewport, &context);
    for (size_t i = 0; i < sum.size(); ++i) sum[i] += pixels[i];
  }
  Image image(options.width, options.height);
  const size_t row = size_t{3} * options.width;
  for (int y = 0; y < options.height; ++y) {  // OpenGL's rows come from the bottom
    const std::uint16_t* from = &sum[row * (options.height - 1 - y)];
    for (size_t i = 0; i < row; ++i) {
      image.rgb[row * y + i] = static_cast<std::uint8_t>((from[i] + passes / 2) / passes);
    }
  }
  return image;
}

Vector2d Offscreen::State::project(const Camera& camera, const Vector3d& p) const {
  const auto [right, up, forward] = axesOf(camera.view);
  const Vector3d from_eye = p - *camera.look_at + camera.distance * forward;
  const double depth = std::max(from_eye.dot(forward), 1e-3 * size);
  const double scale = options.height / (2 * std::tan(kFieldOfView / 2 * kDegree) * depth);
  return {options.width / 2.0 + scale * from_eye.dot(right),
          options.height / 2.0 - scale * from_eye.dot(up)};
}

void Offscreen::State::overlay(const sim::Frame& frame, const Camera& camera,
                               const DrawOptions& draw, Image& image) const {
  if (draw.contact_forces) {
    std::map<int, BodyForce> forces;
    const auto add = [&](int body, int other, const Vector3d& p, const Vector3d& f) {
      if (!model->isRobot({body}) || model->isRobot({other}) || other >= m->nbody) return;
      BodyForce& sum = forces[body];
      sum.weighted += f.norm() * p;
      sum.weight += f.norm();
      sum.force += f;
    };
    for (const sim::Contact& c : frame.contacts) {
      add(c.body_a.value, c.body_b.value, c.p_WC, -c.f_WC);
      add(c.body_b.value, c.body_a.value, c.p_WC, c.f_WC);
    }
    const double weight = model->mass() * Vector3d(m->opt.gravity).norm();
    for (const auto& [body, sum] : forces) {
      const double relative = weight > 0 ? sum.force.norm() / weight : 1;
      if (!(relative > kLeastForce)) continue;
      const Vector3d from = sum.weighted / sum.weight;
      const double length = size * std::min(kArrowPerWeight * relative, kArrowMost);
      drawArrow(image, project(camera, from),
                project(camera, from + length * sum.force.normalized()), options.height / 130.0,
                kForceColor);
    }
  }
  if (draw.com) {
    const Eigen::Map<const Vector3d> com(d->subtree_com +
                                         size_t{3} * std::max(0, model->root().value));
    drawComMark(image, project(camera, com), options.height / 50.0);
  }
}

Offscreen::Offscreen(std::shared_ptr<const sim::Model> model, const OffscreenOptions& options) {
  for (const int side : {options.width, options.height}) {
    if (side < kLeastSide || side > kMostSide) {
      throw InputError(fmt::format("a picture of {}x{} pixels: each side must be in [{}, {}]",
                                   options.width, options.height, kLeastSide, kMostSide));
    }
  }
  state_ = std::make_unique<State>(std::move(model), options);
}

Offscreen::~Offscreen() = default;

Image Offscreen::draw(const sim::Frame& frame, const Camera& camera, const DrawOptions& options) {
  const Camera aimed = state_->aim({&frame, 1}, camera)[0];
  state_->pose(frame);
  Image image = state_->render(aimed);
  state_->overlay(frame, aimed, options, image);
  return image;
}

std::vector<Camera> Offscreen::aim(std::span<const sim::Frame> motion, const Camera& camera) {
  return state_->aim(motion, camera);
}

double Offscreen::robotSize() const {
  return state_->size;
}

}  // namespace traceur::render
