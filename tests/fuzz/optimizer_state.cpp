// Any bytes as the state of any optimiser: refused, or a state from which the search goes on.
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "tests/contract/crafted_state.h"
#include "traceur/core/error.h"
#include "traceur/optim/all.h"

namespace {

using namespace traceur;         // NOLINT(google-build-using-namespace)
using namespace traceur::optim;  // NOLINT(google-build-using-namespace)

/// A box with a constraint and trials that fail, for one task or three.
class Mixed : public Problem {
 public:
  explicit Mixed(int tasks) : tasks_(tasks) {}
  VectorXd lower() const override { return VectorXd::Constant(2, -2); }
  VectorXd upper() const override { return VectorXd::Constant(2, 3); }
  std::vector<std::string> constraints() const override { return {"wall"}; }
  VectorXd tasks() const override {
    return tasks_ > 0 ? VectorXd(VectorXd::LinSpaced(tasks_, 0, 1)) : VectorXd();
  }
  Evaluation evaluate(const VectorXd& x) const override {
    if (x[1] > 2.2) return {.failed = true};
    return {.cost = x.squaredNorm(),
            .violated = {x[0] < -1},
            .task_costs = std::vector<double>(tasks_, x.squaredNorm())};
  }

 private:
  int tasks_;
};

struct Subject {
  const Problem* problem;
  std::unique_ptr<Optimizer> optimizer;
};

Subject make(std::uint8_t which) {
  static const Mixed kSingle(0);
  static const Mixed kFamily(3);
  const OptimizerEntry& entry = allOptimizers()[which % allOptimizers().size()];
  const Mixed& problem = entry.learns_families ? kFamily : kSingle;
  return {&problem, entry.make(problem, {.lambda = 6})};
}

}  // namespace

/// The first byte chooses the optimiser. An odd second byte: the rest is a state, whose fingerprint
/// is mended. An even one: the rest are edits of a state after so many generations, each of ten
/// bytes: two say where, eight say what.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  Subject subject = make(data[0]);
  std::string state(reinterpret_cast<const char*>(data) + 2, size - 2);
  if (data[1] % 2 == 0) {
    tryGenerations(*subject.optimizer, *subject.problem, data[1] / 2 % 8);
    const std::string edits = std::move(state);
    state = subject.optimizer->save();
    for (size_t at = 0; at + 10 <= edits.size(); at += 10) {
      std::uint16_t where = 0;
      std::memcpy(&where, edits.data() + at, sizeof where);
      if (where + 8U <= state.size()) std::memcpy(state.data() + where, edits.data() + at + 2, 8);
    }
  }
  fingerprintAnew(state);
  try {
    subject.optimizer->restore(state);
    tryGenerations(*subject.optimizer, *subject.problem, 3);
  } catch (const InputError&) {  // NOLINT(bugprone-empty-catch): refused, as it should be
  }
  return 0;
}
