#include "traceur/fall/plan_library.h"

#include <fmt/format.h>

#include <bit>
#include <cstdlib>
#include <cstring>

#include "traceur/core/error.h"
#include "traceur/core/hash.h"
#include "traceur/core/pending_file.h"
#include "traceur/core/toml.h"
#include "traceur/fall/embedded/fall_plan.h"

namespace traceur::fall {
namespace {

static_assert(std::endian::native == std::endian::little, "libraries are little-endian");

template <size_t N>
void copyName(const std::string& from, char (&to)[N]) {
  std::memset(to, 0, N);
  std::memcpy(to, from.data(), std::min(from.size(), N - 1));
}

fall_axis axisOf(const ValueTable::Axis& axis) {
  return {static_cast<float>(axis.min), static_cast<float>(axis.max),
          static_cast<std::uint32_t>(axis.n)};
}

void put(std::string& bytes, size_t at, const void* what, size_t size) {
  if (bytes.size() < at + size) bytes.resize(at + size);
  std::memcpy(bytes.data() + at, what, size);
}

/// The bytes as the reader wants them: aligned to 4.
class Opened {
 public:
  explicit Opened(std::string_view bytes) : words_(bytes.size() / 4 + 1) {
    std::memcpy(words_.data(), bytes.data(), bytes.size());
    wrong_ = fall_open(words_.data(), bytes.size(), &library_);
  }
  const char* wrong() const { return wrong_; }
  const fall_library& contents() const { return *library_; }

 private:
  std::vector<std::uint32_t> words_;
  const fall_library* library_ = nullptr;
  const char* wrong_ = nullptr;
};

/// Whether the reader knows the model.
bool storable(const FallProblem& p) {
  return p.model.post_impact == PostImpact::kComVelocity && !p.model.reversed_coriolis;
}

std::uint64_t fingerprintIn(const fall_library& l) {
  return l.problem[0] | static_cast<std::uint64_t>(l.problem[1]) << 32;
}

}  // namespace

std::uint64_t fingerprintOf(const FallProblem& p, const ValueGrid& grid) {
  Hash hash;
  const auto add = [&](std::initializer_list<double> numbers) {
    hash.add(std::span<const double>(numbers.begin(), numbers.size()));
  };
  add({ValueTable::kVersion, p.model.mass, p.model.inertia, p.model.gravity, p.model.step,
       static_cast<double>(p.model.post_impact), p.model.reversed_coriolis ? 1.0 : 0.0, p.rod_speed,
       p.stopper_speed, p.least_interval, static_cast<double>(p.grid.rod_rates), p.grid.time,
       p.grid.angle, static_cast<double>(p.stall), p.horizon, static_cast<double>(grid.times),
       static_cast<double>(grid.angles), static_cast<double>(grid.lengths),
       static_cast<double>(grid.rates)});
  for (size_t i = 0; i < p.graph.nodes.size(); ++i) {
    hash.add(p.graph.nodes[i].name);
    add({p.lengths[i].first, p.lengths[i].second, static_cast<double>(p.graph.edges[i].size())});
    for (size_t e = 0; e < p.graph.edges[i].size(); ++e) {
      const ReachTable& reach = p.reach[i][e];
      add({static_cast<double>(p.graph.edges[i][e]), p.first_angle[i][e], reach.cell()});
      hash.add(std::string_view(reinterpret_cast<const char*>(reach.marked().data()),
                                reach.marked().size()));
    }
  }
  return hash.value();
}

std::string compileLibrary(const FallProblem& p, const ValueTable& table,
                           const LibraryLabel& label) {
  if (!storable(p)) {
    throw InputError("a library of fall plans has only the default post-impact model");
  }
  fall_library l{};
  std::memcpy(l.magic, FALL_LIBRARY_MAGIC, sizeof l.magic);
  l.version = FALL_LIBRARY_VERSION;
  const std::uint64_t fingerprint = fingerprintOf(p, table.grid());
  l.problem[0] = static_cast<std::uint32_t>(fingerprint);
  l.problem[1] = static_cast<std::uint32_t>(fingerprint >> 32);
  copyName(label.robot, l.robot);
  copyName(label.stance, l.stance);
  copyName(label.direction, l.direction);
  l.mass = static_cast<float>(p.model.mass);
  l.inertia = static_cast<float>(p.model.inertia);
  l.gravity = static_cast<float>(p.model.gravity);
  l.step = static_cast<float>(p.model.step);
  l.rod_speed = static_cast<float>(p.rod_speed);
  l.stopper_speed = static_cast<float>(p.stopper_speed);
  l.least_interval = static_cast<float>(p.least_interval);
  l.grid_time = static_cast<float>(p.grid.time);
  l.grid_angle = static_cast<float>(p.grid.angle);
  l.horizon = static_cast<float>(p.horizon);
  l.rod_rates = static_cast<std::uint32_t>(p.grid.rod_rates);
  l.stall_stops = p.stall == Stall::kStops ? 1 : 0;
  l.nodes = static_cast<std::uint32_t>(p.graph.nodes.size());
  l.first_node = sizeof l;
  size_t edges = 0;
  for (const auto& e : p.graph.edges) edges += e.size();
  const size_t first_edge = sizeof l + l.nodes * sizeof(fall_library_node);
  const size_t values = first_edge + edges * sizeof(fall_library_edge);
  const size_t value_bytes = table.values().size() * sizeof(float);
  std::string bytes(values + value_bytes, '\0');
  put(bytes, values, table.values().data(), value_bytes);
  size_t edge_at = first_edge;
  for (size_t i = 0; i < p.graph.nodes.size(); ++i) {
    const ValueTable::Node& from = table.nodes()[i];
    fall_library_node node{};
    copyName(p.graph.nodes[i].name, node.name);
    node.edges = static_cast<std::uint32_t>(p.graph.edges[i].size());
    node.first_edge = static_cast<std::uint32_t>(edge_at);
    node.time = axisOf(from.time);
    node.theta = axisOf(from.theta);
    node.r = axisOf(from.r);
    node.rate = axisOf(from.rate);
    node.values = static_cast<std::uint32_t>(values + from.first * sizeof(float));
    put(bytes, l.first_node + i * sizeof node, &node, sizeof node);
    for (size_t e = 0; e < p.graph.edges[i].size(); ++e) {
      const ReachTable& reach = p.reach[i][e];
      const std::vector<std::uint8_t>& marked = reach.marked();
      std::string bits((marked.size() + 31) / 32 * 4, '\0');
      for (size_t b = 0; b < marked.size(); ++b) {
        if (marked[b] != 0) bits[b / 8] = static_cast<char>(bits[b / 8] | 1 << (b % 8));
      }
      const fall_library_edge edge{static_cast<std::uint32_t>(p.graph.edges[i][e]),
                                   static_cast<float>(p.first_angle[i][e]),
                                   static_cast<float>(reach.cell()),
                                   static_cast<std::uint32_t>(reach.cells()),
                                   ReachTable::kAngles,
                                   static_cast<std::uint32_t>(bytes.size())};
      put(bytes, bytes.size(), bits.data(), bits.size());
      put(bytes, edge_at, &edge, sizeof edge);
      edge_at += sizeof edge;
    }
  }
  l.size = static_cast<std::uint32_t>(bytes.size());
  put(bytes, 0, &l, sizeof l);
  static constexpr size_t kSummed = offsetof(fall_library, problem);
  l.checksum = fall_checksum(bytes.data() + kSummed, bytes.size() - kSummed);
  put(bytes, 0, &l, sizeof l);
  return bytes;
}

ValueTable tableFromLibrary(std::string_view bytes, const FallProblem& problem,
                            const std::string& name) {
  const Opened opened(bytes);
  if (opened.wrong()) throw InputError(fmt::format("{}: {}", name, opened.wrong()));
  const fall_library& l = opened.contents();
  const fall_library_node* nodes = fall_node(&l, 0);
  const ValueGrid grid{static_cast<int>(nodes->time.n), static_cast<int>(nodes->theta.n),
                       static_cast<int>(nodes->r.n), static_cast<int>(nodes->rate.n)};
  if (fingerprintIn(l) != fingerprintOf(problem, grid)) {
    throw InputError(fmt::format(
        "{}: was made for another robot, stance or options (it says {}, {} {}); make it anew with "
        "traceur fall compile",
        name, l.robot, l.stance, l.direction));
  }
  // The fingerprint is no proof: whoever writes a file can write that, too.
  const size_t each = size_t{nodes->time.n} * nodes->theta.n * nodes->r.n * nodes->rate.n;
  if (l.nodes != problem.graph.nodes.size() ||
      !fall_holds(&l, nodes->values, each * l.nodes, sizeof(float))) {
    throw InputError(fmt::format("{}: a library of fall plans that contradicts itself", name));
  }
  const auto* values =
      reinterpret_cast<const float*>(reinterpret_cast<const char*>(&l) + nodes->values);
  return ValueTable(problem, grid, values);
}

ValueTable cachedTable(const FallProblem& problem, const LibraryLabel& label,
                       const std::filesystem::path& folder) {
  if (folder.empty() || !storable(problem)) return ValueTable(problem);
  const std::filesystem::path file =
      folder / fmt::format("{:016x}.fallplan", fingerprintOf(problem));
  try {
    return tableFromLibrary(readFile(file), problem, file.string());
  } catch (const InputError&) {  // missing or damaged: made below
  }
  ValueTable table(problem);
  try {
    makeFolder(folder);
    PendingFile pending(file);
    pending.write(compileLibrary(problem, table, label));
    pending.commit();
  } catch (const SystemError&) {  // it can do without
  }
  return table;
}

std::filesystem::path tableCache() {
  const char* cache = std::getenv("XDG_CACHE_HOME");
  if (cache && *cache == '/') return std::filesystem::path(cache) / "traceur" / "falls";
  const char* home = std::getenv("HOME");
  if (home && *home == '/') return std::filesystem::path(home) / ".cache" / "traceur" / "falls";
  return {};
}

}  // namespace traceur::fall
