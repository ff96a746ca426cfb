#include "traceur/render/gltf.h"

#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <span>
#include <vector>

#include "traceur/core/error.h"
#include "traceur/sim/engine.h"
#include "traceur/sim/model.h"

namespace traceur::render {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using Json = nlohmann::ordered_json;

// What the format calls its numbers.
constexpr int kFloat = 5126;
constexpr int kUnsigned = 5125;
constexpr int kVertices = 34962;
constexpr int kIndices = 34963;

constexpr int kSlices = 24;       // around a ball [ours]
constexpr int kStacks = 12;       // from pole to pole, even: a capsule is parted in the middle
constexpr float kGround = 20;     // half the side of a plane without end [m, ours]
constexpr double kStill = 1e-12;  // of what does not move, the most that rounding moves it

/// Triangles in a geom's frame.
struct Shape {
  std::vector<Vector3f> vertices, normals;
  std::vector<std::uint32_t> indices;

  void quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    indices.insert(indices.end(), {a, b, c, a, c, d});
  }
};

/// A ball drawn to half axes, its upper half moved up by `half` and its lower down.
Shape ball(const Vector3d& axes, double half) {
  Shape s;
  for (int i = 0; i <= kStacks + 1; ++i) {
    // The middle is there twice: what lies between is a capsule's side.
    const int stack = i <= kStacks / 2 ? i : i - 1;
    const double polar = std::numbers::pi * stack / kStacks;
    for (int k = 0; k <= kSlices; ++k) {
      const double turn = 2 * std::numbers::pi * k / kSlices;
      const Vector3d u(std::sin(polar) * std::cos(turn), std::sin(polar) * std::sin(turn),
                       std::cos(polar));
      const Vector3d lift(0, 0, i <= kStacks / 2 ? half : -half);
      s.vertices.emplace_back((u.cwiseProduct(axes) + lift).cast<float>());
      s.normals.emplace_back(u.cwiseQuotient(axes).normalized().cast<float>());
    }
  }
  static constexpr std::uint32_t kRow = kSlices + 1;
  for (std::uint32_t i = 0; i <= kStacks; ++i) {
    for (std::uint32_t k = 0; k < kSlices; ++k) {
      const std::uint32_t at = i * kRow + k;
      s.quad(at, at + kRow, at + kRow + 1, at + 1);
    }
  }
  return s;
}

Shape cylinder(double radius, double half) {
  Shape s;
  for (const double side : {1.0, -1.0}) {
    const auto middle = static_cast<std::uint32_t>(s.vertices.size());
    s.vertices.emplace_back(0, 0, side * half);
    s.normals.emplace_back(0, 0, side);
    for (int k = 0; k <= kSlices; ++k) {
      const double turn = side * 2 * std::numbers::pi * k / kSlices;
      s.vertices.emplace_back(radius * std::cos(turn), radius * std::sin(turn), side * half);
      s.normals.emplace_back(0, 0, side);
      const auto at = static_cast<std::uint32_t>(s.vertices.size()) - 1;
      if (k > 0) s.indices.insert(s.indices.end(), {middle, at - 1, at});
    }
  }
  for (int k = 0; k <= kSlices; ++k) {
    const double turn = 2 * std::numbers::pi * k / kSlices;
    for (const double side : {1.0, -1.0}) {
      s.vertices.emplace_back(radius * std::cos(turn), radius * std::sin(turn), side * half);
      s.normals.emplace_back(std::cos(turn), std::sin(turn), 0);
    }
    const auto at = static_cast<std::uint32_t>(s.vertices.size()) - 1;
    if (k > 0) s.quad(at - 3, at - 2, at, at - 1);
  }
  return s;
}

/// A rectangle with its normal along axis `k`, on the side `side`.
void addSide(Shape& s, const Vector3d& half, int k, double side) {
  const auto at = static_cast<std::uint32_t>(s.vertices.size());
  for (const auto& [a, b] : {std::pair(-1, -1), {1, -1}, {1, 1}, {-1, 1}}) {
    Vector3d v;
    v[k] = side * half[k];
    v[(k + 1) % 3] = a * side * half[(k + 1) % 3];
    v[(k + 2) % 3] = b * half[(k + 2) % 3];
    s.vertices.emplace_back(v.cast<float>());
    s.normals.emplace_back((side * Vector3d::Unit(k)).cast<float>());
  }
  s.quad(at, at + 1, at + 2, at + 3);
}

Shape meshOf(const mjModel* m, int mesh) {
  Shape s;
  const float* vertices = m->mesh_vert + 3 * static_cast<ptrdiff_t>(m->mesh_vertadr[mesh]);
  const int* faces = m->mesh_face + 3 * static_cast<ptrdiff_t>(m->mesh_faceadr[mesh]);
  // Flat: each triangle has its own corners.
  for (int f = 0; f < m->mesh_facenum[mesh]; ++f) {
    Vector3f corner[3];
    for (int k = 0; k < 3; ++k) corner[k] = Vector3f(vertices + 3 * ptrdiff_t{faces[3 * f + k]});
    Vector3f normal = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
    normal = normal.norm() > 0 ? Vector3f(normal.normalized()) : Vector3f(Vector3f::UnitZ());
    for (const Vector3f& v : corner) {
      s.indices.push_back(static_cast<std::uint32_t>(s.vertices.size()));
      s.vertices.push_back(v);
      s.normals.push_back(normal);
    }
  }
  return s;
}

Shape shapeOf(const mjModel* m, int geom) {
  const Eigen::Map<const Vector3d> size(m->geom_size + 3 * static_cast<ptrdiff_t>(geom));
  Shape s;
  switch (m->geom_type[geom]) {
    case mjGEOM_SPHERE:
      return ball(Vector3d::Constant(size[0]), 0);
    case mjGEOM_ELLIPSOID:
      return ball(size, 0);
    case mjGEOM_CAPSULE:
      return ball(Vector3d::Constant(size[0]), size[1]);
    case mjGEOM_CYLINDER:
      return cylinder(size[0], size[1]);
    case mjGEOM_BOX:
      for (int k = 0; k < 3; ++k) {
        for (const double side : {1.0, -1.0}) addSide(s, size, k, side);
      }
      return s;
    case mjGEOM_PLANE:
      addSide(s, {size[0] > 0 ? size[0] : kGround, size[1] > 0 ? size[1] : kGround, 0}, 2, 1);
      return s;
    case mjGEOM_MESH:
      return meshOf(m, m->geom_dataid[geom]);
    default:
      return s;  // a height field or a distance field: not drawn
  }
}

class Writer {
 public:
  Writer(const mjModel* m, const sim::Recording& recording) : m_(m) {
    json_ = {{"asset", {{"version", "2.0"}, {"generator", "Traceur"}}},
             {"scene", 0},
             {"scenes", Json::array({{{"nodes", Json::array({0})}}})},
             {"nodes", Json::array()},
             {"meshes", Json::array()},
             {"materials", Json::array()},
             {"accessors", Json::array()},
             {"bufferViews", Json::array()}};
    for (int b = 0; b < m->nbody; ++b) body(b);
    for (const int b : children(0)) json_["nodes"][0]["children"].push_back(b);
    animate(recording);
  }

  std::string bytes() {
    for (const char* list : {"meshes", "materials"}) {
      if (json_[list].empty()) json_.erase(list);  // an empty list is not allowed
    }
    json_["buffers"].push_back({{"byteLength", data_.size()}});
    // A stranger's names may be no UTF-8.
    std::string text = json_.dump(-1, ' ', false, Json::error_handler_t::replace);
    text.resize((text.size() + 3) / 4 * 4, ' ');
    std::string out = "glTF";
    const auto add = [&out](size_t number) {
      for (int k = 0; k < 4; ++k) out += static_cast<char>(number >> (8 * k) & 0xFF);
    };
    add(2);  // version
    add(12 + 8 + text.size() + 8 + data_.size());
    add(text.size());
    out += "JSON" + text;
    add(data_.size());
    out += std::string("BIN\0", 4) + data_;
    return out;
  }

 private:
  // Numbers ---------------------------------------------------------------------------------------
  static_assert(std::endian::native == std::endian::little, "the format is little-endian");
  template <class Number>
  int accessor(std::span<const Number> numbers, const char* type, size_t of, int component,
               int target = 0) {
    json_["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", data_.size()}, {"byteLength", numbers.size_bytes()}});
    if (target) json_["bufferViews"].back()["target"] = target;
    data_.append(reinterpret_cast<const char*>(numbers.data()), numbers.size_bytes());
    json_["accessors"].push_back({{"bufferView", json_["bufferViews"].size() - 1},
                                  {"componentType", component},
                                  {"count", numbers.size() / of},
                                  {"type", type}});
    return static_cast<int>(json_["accessors"].size()) - 1;
  }
  int vectors(const std::vector<Vector3f>& v, int target = 0) {
    static_assert(sizeof(Vector3f) == 3 * sizeof(float));
    return accessor(std::span(v.data()->data(), 3 * v.size()), "VEC3", 3, kFloat, target);
  }

  // Bodies ----------------------------------------------------------------------------------------
  std::vector<int> children(int body) const {
    std::vector<int> all;
    for (int b = body + 1; b < m_->nbody; ++b) {
      if (m_->body_parentid[b] == body) all.push_back(b);
    }
    return all;
  }
  int material(int geom) {
    const float* rgba = m_->geom_matid[geom] >= 0
                            ? m_->mat_rgba + 4 * static_cast<ptrdiff_t>(m_->geom_matid[geom])
                            : m_->geom_rgba + 4 * static_cast<ptrdiff_t>(geom);
    Json colour = Json::array();
    // The format's colours are linear, the engine's as they are seen.
    for (int k = 0; k < 4; ++k) colour.push_back(k < 3 ? std::pow(rgba[k], 2.2F) : rgba[k]);
    Json made = {{"pbrMetallicRoughness",
                  {{"baseColorFactor", colour}, {"metallicFactor", 0}, {"roughnessFactor", 0.8}}}};
    if (rgba[3] < 1) made["alphaMode"] = "BLEND";
    Json& all = json_["materials"];
    const auto found = std::find(all.begin(), all.end(), made);
    if (found != all.end()) return static_cast<int>(found - all.begin());
    all.push_back(std::move(made));
    return static_cast<int>(all.size()) - 1;
  }
  void body(int b) {
    const char* name = m_->names + m_->name_bodyadr[b];
    Json node = {{"name", *name ? std::string(name) : fmt::format("body {}", b)}};
    const std::vector<int> hang = children(b);
    if (b > 0 && !hang.empty()) node["children"] = hang;
    if (b == 0) {  // x forward, z up become z forward, y up
      node["name"] = "world";
      node["rotation"] = {-0.5, -0.5, -0.5, 0.5};
    }
    Json mesh;
    for (int g = m_->body_geomadr[b], n = 0; n < m_->body_geomnum[b]; ++g, ++n) {
      // As pictures: the engine shows groups 0 to 2.
      if (m_->geom_group[g] > 2) continue;
      Shape s = shapeOf(m_, g);
      if (s.indices.empty()) continue;
      place(s, g);
      Vector3f low = s.vertices[0];
      Vector3f high = low;
      for (const Vector3f& v : s.vertices) {
        low = low.cwiseMin(v);
        high = high.cwiseMax(v);
      }
      const int vertices = vectors(s.vertices, kVertices);
      json_["accessors"].back()["min"] = {low.x(), low.y(), low.z()};
      json_["accessors"].back()["max"] = {high.x(), high.y(), high.z()};
      const int normals = vectors(s.normals, kVertices);
      const int indices =
          accessor(std::span<const std::uint32_t>(s.indices), "SCALAR", 1, kUnsigned, kIndices);
      mesh["primitives"].push_back({{"attributes", {{"POSITION", vertices}, {"NORMAL", normals}}},
                                    {"indices", indices},
                                    {"material", material(g)}});
    }
    if (!mesh.is_null()) {
      node["mesh"] = json_["meshes"].size();
      json_["meshes"].push_back(std::move(mesh));
    }
    json_["nodes"].push_back(std::move(node));
  }
  /// From the geom's frame to the body's.
  void place(Shape& s, int g) const {
    const mjtNum* q = m_->geom_quat + 4 * static_cast<ptrdiff_t>(g);
    const Eigen::Quaternionf turn =
        Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().cast<float>();
    const Eigen::Map<const Vector3d> at(m_->geom_pos + 3 * static_cast<ptrdiff_t>(g));
    for (Vector3f& v : s.vertices) v = turn * v + at.cast<float>();
    for (Vector3f& v : s.normals) v = turn * v;
  }

  // Motion ----------------------------------------------------------------------------------------
  void animate(const sim::Recording& recording) {
    const auto free = [](mjData* d) { mj_deleteData(d); };
    const std::unique_ptr<mjData, decltype(free)> data(mj_makeData(m_), free);
    mjData* d = data.get();
    const auto bodies = static_cast<size_t>(m_->nbody);
    std::vector<std::vector<Vector3d>> at(bodies);
    std::vector<std::vector<Eigen::Quaterniond>> turned(bodies);
    std::vector<float> times;
    for (const sim::Frame& f : recording.frames) {
      if (f.state.q.size() != m_->nq || !f.state.q.allFinite()) {
        throw InputError("a frame is not one of its scene, or holds NaN");
      }
      times.push_back(static_cast<float>(f.state.time - recording.frames[0].state.time));
      std::copy_n(f.state.q.data(), m_->nq, d->qpos);
      mj_kinematics(m_, d);
      for (size_t b = 1; b < bodies; ++b) {
        const auto on = static_cast<size_t>(m_->body_parentid[b]);
        const auto place = [&](size_t of) {
          const mjtNum* q = d->xquat + 4 * of;
          return Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
        };
        const Eigen::Quaterniond back = place(on).conjugate();
        const Eigen::Map<const Vector3d> mine(d->xpos + 3 * b);
        const Eigen::Map<const Vector3d> parent(d->xpos + 3 * on);
        at[b].emplace_back(back * (mine - parent));
        Eigen::Quaterniond q = (back * place(b)).normalized();
        // Of the two that are one turn, the nearer: between frames programs go the straight way.
        if (!turned[b].empty() && turned[b].back().dot(q) < 0) q.coeffs() *= -1;
        turned[b].push_back(q);
      }
    }
    Json samplers = Json::array();
    Json channels = Json::array();
    int input = -1;
    const auto track = [&](size_t b, const char* path, int output) {
      if (input < 0) {
        input = accessor(std::span<const float>(times), "SCALAR", 1, kFloat);
        json_["accessors"].back()["min"] = {times.front()};
        json_["accessors"].back()["max"] = {times.back()};
      }
      channels.push_back({{"sampler", samplers.size()}, {"target", {{"node", b}, {"path", path}}}});
      samplers.push_back({{"input", input}, {"output", output}, {"interpolation", "LINEAR"}});
    };
    for (size_t b = 1; b < bodies && !times.empty(); ++b) {
      Json& node = json_["nodes"][b];
      const Vector3d& p = at[b][0];
      const Eigen::Vector4d q = turned[b][0].coeffs();  // x y z w, as the format has it
      node["translation"] = {p.x(), p.y(), p.z()};
      node["rotation"] = {q[0], q[1], q[2], q[3]};
      const bool moves = std::ranges::any_of(
          at[b], [&](const Vector3d& x) { return (x - p).squaredNorm() > kStill * kStill; });
      const bool turns = std::ranges::any_of(turned[b], [&](const Eigen::Quaterniond& x) {
        return (x.coeffs() - q).squaredNorm() > kStill * kStill;
      });
      if (moves) {
        std::vector<Vector3f> all;
        for (const Vector3d& x : at[b]) all.emplace_back(x.cast<float>());
        track(b, "translation", vectors(all));
      }
      if (turns) {
        std::vector<float> all;
        for (const Eigen::Quaterniond& x : turned[b]) {
          for (const double c : x.coeffs()) all.push_back(static_cast<float>(c));
        }
        track(b, "rotation", accessor(std::span<const float>(all), "VEC4", 4, kFloat));
      }
    }
    if (channels.empty()) return;
    json_["animations"].push_back(
        {{"name", "motion"}, {"channels", channels}, {"samplers", samplers}});
  }

  const mjModel* m_;
  Json json_;
  std::string data_;
};

}  // namespace

std::string toGlb(const sim::Recording& recording) {
  std::string error;
  const auto m = sim::compileText(recording.mjcf, error);
  if (!m) throw InputError(fmt::format("the scene cannot be made again: {}", error));
  return Writer(m.get(), recording).bytes();
}

}  // namespace traceur::render
