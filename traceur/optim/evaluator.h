// Who runs a generation's trials: threads of this process, or whatever else there is.
#pragma once

#include <functional>
#include <span>

#include "traceur/core/thread_pool.h"
#include "traceur/optim/optimizer.h"

namespace traceur::optim {

class Evaluator {
 public:
  virtual ~Evaluator() = default;

  /// Gives what a trial says, or throws what Problem::evaluate threw. Called once at most.
  using Result = std::function<Evaluation()>;
  /// @param i  of the candidate
  using Take = std::function<void(int i, const Result& result)>;

  /// Runs the problem's trials and calls take for each candidate once, in any order and on any
  /// thread; returns when all have been taken. A trial is run when its result is called, or before:
  /// what take leaves alone need not be run. What take throws passes through once the others have
  /// been taken, of several that of the smallest i.
  virtual void evaluate(const Problem& problem, std::span<const Candidate> candidates,
                        const Take& take) = 0;
};

/// The threads of this process.
class ThreadEvaluator : public Evaluator {
 public:
  /// @param threads  as ThreadPool
  explicit ThreadEvaluator(int threads) : pool_(threads) {}

  void evaluate(const Problem& problem, std::span<const Candidate> candidates,
                const Take& take) override {
    pool_.forEach(static_cast<int>(candidates.size()),
                  [&](int i) { take(i, [&] { return problem.evaluate(candidates[i].x); }); });
  }

 private:
  ThreadPool pool_;
};

}  // namespace traceur::optim
