// Does our CMA-ES need as few trials as the best of its peers?
//
// Protocol: σ₀ = 0.5, x₀ uniform in [-2, 2]ⁿ, default λ, own stopping rules on; trials until a
// generation holds a cost ≤ 1e-10, whole generations counted (as pycma's counter does); median over
// the runs that got there, with their number; at most 200 000 trials. Rosenbrock's failures end in
// its local minimum of about 3.99.
//
//   optim_parity [--seeds 51] [--seed 1] [--threads 1] [--csv FILE]
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "traceur/core/random.h"
#include "traceur/core/thread_pool.h"
#include "traceur/optim/cma_es.h"
#include "traceur/optim/minimise.h"
#include "traceur/optim/test_functions.h"

namespace {

using namespace traceur;
using Eigen::VectorXd;

/// The peers' medians under the same protocol with 11 seeds, measured by us in November 2026 with
/// cmaes 0.9.1, libcmaes 0.10.3 (default and active) and pycma 4.4.0. With 11 seeds, differences
/// below about 8 % are noise.
struct Peers {
  const char* function;
  int n;
  int cmaes, libcmaes, libcmaes_active, pycma;

  std::pair<int, const char*> best() const {
    return std::min({std::pair(cmaes, "cmaes"), std::pair(libcmaes, "libcmaes"),
                     std::pair(libcmaes_active, "libcmaes active"), std::pair(pycma, "pycma")});
  }
};
constexpr Peers kPeers[] = {
    {"sphere", 5, 844, 827, 766, 801},          {"sphere", 10, 1700, 1719, 1648, 1682},
    {"sphere", 20, 3149, 3176, 3124, 3111},     {"ellipsoid", 5, 1711, 2185, 1774, 1588},
    {"ellipsoid", 10, 4427, 6072, 4612, 4282},  {"ellipsoid", 20, 13721, 18267, 13177, 13326},
    {"cigar", 5, 1878, 2109, 1837, 1749},       {"cigar", 10, 4301, 4611, 4277, 4132},
    {"cigar", 20, 8780, 8751, 8580, 8466},      {"rosenbrock", 5, 1981, 2283, 2161, 2056},
    {"rosenbrock", 10, 5341, 6962, 5732, 5372}, {"rosenbrock", 20, 17311, 20844, 16900, 17584},
};

/// A cell passes within this factor of the best peer and with this share of successes.
constexpr double kWithin = 1.10;
constexpr double kSuccesses = 0.70;

struct Run {
  bool reached = false;
  int trials = 0;
  std::string reason;
};

Run run(const optim::TestFunction& function, int n, std::uint64_t seed) {
  const optim::FunctionProblem problem(n, function.f);
  // The starting points are shared by all functions; stream and index keep them apart from the
  // samples, which use (seed, generation, candidate).
  Random random(seed, UINT64_MAX, n);
  VectorXd x0(n);
  for (int i = 0; i < n; ++i) x0[i] = random.uniform(-2, 2);
  optim::CmaEs cma({.x0 = x0, .sigma = 0.5, .seed = seed});
  const optim::Summary s = minimise(problem, cma, {.budget = 200000, .target = 1e-10});
  return {s.end == optim::End::kTarget, s.progress.evaluations, s.stop.reason};
}

double median(std::vector<int> v) {
  if (v.empty()) return NAN;
  std::sort(v.begin(), v.end());
  return (v[v.size() / 2] + v[(v.size() - 1) / 2]) / 2.0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Trials CMA-ES needs to 1e-10, beside its peers");
  int seeds = 51;
  int threads = 1;
  std::uint64_t first = 1;
  std::string csv;
  app.add_option("--seeds", seeds, "runs for each function and dimension")
      ->check(CLI::Range(1, 100000));
  app.add_option("--seed", first, "the first of them");
  app.add_option("--threads", threads)->check(CLI::Range(1, 1024));
  app.add_option("--csv", csv, "also write the table here");
  CLI11_PARSE(app, argc, argv);

  ThreadPool pool(threads);
  std::string table = "function,n,median,reached,seeds,best_peer,peer,ratio\n";
  fmt::print("{:<11} {:>3} {:>8} {:>9} {:>9}  {:<16} {:>6}\n", "function", "n", "median", "reached",
             "best peer", "", "ratio");
  bool all_pass = true;
  for (const Peers& peers : kPeers) {
    const auto& functions = optim::testFunctions();
    const auto& function = *std::find_if(functions.begin(), functions.end(),
                                         [&](const auto& f) { return f.name == peers.function; });
    std::vector<Run> runs(seeds);
    pool.forEach(seeds, [&](int s) { runs[s] = run(function, peers.n, first + s); });
    std::vector<int> trials;
    std::map<std::string, int> ends;
    for (const Run& r : runs) {
      if (r.reached) trials.push_back(r.trials);
      if (!r.reached) ++ends[r.reason];
    }
    const double m = median(trials);
    const auto [best, who] = peers.best();
    const bool pass =
        m <= kWithin * best && static_cast<double>(trials.size()) >= kSuccesses * seeds;
    all_pass = all_pass && pass;
    std::string failures;
    for (const auto& [reason, count] : ends) failures += fmt::format(" {}×{}", count, reason);
    fmt::print("{:<11} {:>3} {:>8.0f} {:>9} {:>9}  {:<16} {:>6.3f}{}{}\n", peers.function, peers.n,
               m, fmt::format("{}/{}", trials.size(), seeds), best, who, m / best,
               pass ? "" : "  above", failures);
    std::fflush(stdout);
    table += fmt::format("{},{},{},{},{},{},{},{:.4f}\n", peers.function, peers.n, m, trials.size(),
                         seeds, best, who, m / best);
  }
  fmt::print("{}: every median within {:.0f} % of the best peer, at least {:.0f} % of runs there\n",
             all_pass ? "pass" : "FAIL", 100 * (kWithin - 1), 100 * kSuccesses);
  if (!csv.empty() && !(std::ofstream(csv) << table)) {
    fmt::print(stderr, "cannot write {}\n", csv);
    return 1;
  }
  return all_pass ? 0 : 1;
}
