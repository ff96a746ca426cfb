// What restore() believes of a state: every word of it, and the options it was saved under. States
// are changed as someone who means harm would, with the right fingerprint; a wrong word is refused
// for what is wrong with it.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <concepts>
#include <cstring>
#include <functional>
#include <limits>

#include "tests/contract/crafted_state.h"
#include "traceur/core/error.h"
#include "traceur/optim/all.h"
#include "traceur/optim/contextual_cma.h"
#include "traceur/optim/curve_cma.h"
#include "traceur/optim/family_baselines.h"
#include "traceur/optim/state.h"
#include "traceur/optim/test_numbers.h"

namespace traceur::optim {
namespace {

constexpr double kMax = std::numeric_limits<double>::max();
constexpr double kLeast = std::numeric_limits<double>::denorm_min();

/// A number as the word that stands for it.
std::uint64_t wordOf(double value) {
  return std::bit_cast<std::uint64_t>(value);
}
template <std::integral T>
std::uint64_t wordOf(T value) {
  return static_cast<std::uint64_t>(value);
}

/// Goes along a state, word by word, and tries at each what must not stand there.
class Walk {
 public:
  using Make = std::function<std::unique_ptr<Optimizer>()>;

  Walk(Make make, std::string state) : make_(std::move(make)), state_(std::move(state)), at_(8) {
    EXPECT_EQ(outcome(state_), "");
    text();  // kind
    refuses(99, "got version 99");
    next();
  }

  std::uint64_t word() const {
    std::uint64_t value = 0;
    std::memcpy(&value, state_.data() + at_, sizeof value);
    return value;
  }
  void next(size_t words = 1) { at_ += 8 * words; }
  /// This word, so changed, is refused with a message that says why.
  void refuses(auto changed, std::string_view why) const {
    const std::string said = outcome(withWord(state_, at_, wordOf(changed)));
    EXPECT_NE(said.find(why), std::string::npos)
        << "byte " << at_ << " = " << changed << ": expected \"" << why << "\", got \"" << said
        << '"';
  }
  /// This word, so changed, is what the restored optimiser saves.
  void takes(auto changed) const {
    const std::string state = withWord(state_, at_, wordOf(changed));
    const auto optimizer = make_();
    ASSERT_NO_THROW(optimizer->restore(state)) << "byte " << at_ << " = " << changed;
    EXPECT_EQ(optimizer->save(), state) << "byte " << at_ << " = " << changed;
  }

  /// A number in [least, most], and past it.
  void integer(std::uint64_t least, std::uint64_t most) {
    const std::string why = fmt::format("expected a number in [{}, {}], got", least, most);
    refuses(most + 1, why);
    if (least > 0) refuses(least - 1, why);
    next();
  }
  void boolean() { integer(0, 1); }
  void real(double least, double most) {
    const std::string why = fmt::format("expected a number in [{}, {}], got", least, most);
    refuses(kNaN, why);
    refuses(std::nextafter(least, -kInf), why);
    if (most < kInf) refuses(std::nextafter(most, kInf), why);
    next();
  }
  void finite() { real(-kMax, kMax); }
  void positive() { real(kLeast, kMax); }
  /// A count, and so many numbers that may be any.
  void reals(size_t count) {
    refuses(count + 1, fmt::format("expected {} numbers, got {}", count, count + 1));
    next();
    takes(kNaN);
    next(count);
  }
  /// A count, and so many finite numbers.
  void finite(size_t count) {
    refuses(count + 1, fmt::format("expected {} numbers, got {}", count, count + 1));
    next();
    for (size_t i = 0; i < count; ++i) {
      refuses(kNaN, "expected finite numbers, got nan");
      next();
    }
  }
  void text() { at_ += 8 + word(); }
  void noStop() {
    EXPECT_EQ(word(), 0u);
    boolean();
  }
  void end() const { EXPECT_EQ(at_ + 8, state_.size()); }

  size_t at() const { return at_; }
  const std::string& state() const { return state_; }
  /// What restore() says; nothing if it takes it.
  std::string outcome(const std::string& state) const {
    const auto optimizer = make_();
    const std::string before = optimizer->save();
    try {
      optimizer->restore(state);
      return "";
    } catch (const InputError& e) {
      EXPECT_EQ(optimizer->save(), before) << "it has changed something";
      return e.what();
    }
  }

 private:
  Make make_;
  std::string state_;
  size_t at_;
};

/// A valley in two variables, of three tasks, with a wall.
Evaluation valley(const VectorXd& x, int constraints) {
  Evaluation e{.cost = 0};
  for (const double task : {0.0, 0.5, 1.0}) {
    e.task_costs.push_back(std::pow(x[0] - task, 2) + 10 * std::pow(x[1] - x[0], 2));
    e.cost += e.task_costs.back() / 3;
  }
  if (constraints > 0) e.violated.assign(constraints, x[0] + x[1] < -0.1);
  return e;
}

/// Some generations, and the first candidate of the next.
std::string someWay(Optimizer& optimizer, int generations, int constraints = 0) {
  for (int g = 0; g < generations; ++g) {
    for (const Candidate& c : optimizer.ask()) optimizer.tell(c.id, valley(c.x, constraints));
  }
  const Candidate c = optimizer.ask()[0];
  optimizer.tell(c.id, valley(c.x, constraints));
  return optimizer.save();
}

VectorXd threeTasks() {
  return VectorXd::LinSpaced(3, 0, 1);
}

template <class Type, class Options>
Walk::Make maker(const Options& options) {
  return [options] { return std::make_unique<Type>(options); };
}

TEST(Restore, OfCmaEsBelievesNoWord) {
  const CmaEsOptions o{.x0 = VectorXd::Zero(2),
                       .lower = VectorXd::Constant(2, -2),
                       .lambda = 4,
                       .hold_feasible = true};
  CmaEs cma(o);
  Walk w(maker<CmaEs>(o), someWay(cma, 3, 1));
  w.refuses(3, "state of n = 3, lambda = 4; expected n = 2, lambda = 4");
  w.next();
  w.refuses(5, "state of n = 2, lambda = 5; expected n = 2, lambda = 4");
  w.next();
  w.refuses(w.word() + 1, "under other options");
  w.next();
  w.integer(0, kMostGenerations);  // generation
  w.integer(0, 3);                 // updates
  w.real(kLeast, 1e150);           // sigma
  w.finite(2);                     // mean
  w.next();
  for (int i = 0; i < 2; ++i) {  // D
    for (const double bad : {kNaN, kInf, -1.0, 0.0, 0.9e-150, 1.1e150}) w.refuses(bad, "");
    w.refuses(0.9e-150, "its covariance is none");
    w.refuses(1.1e150, "its covariance is none");
    w.takes(1e-150);
    w.takes(1e150);
    w.next();
  }
  w.finite(2);  // p_sigma
  w.finite(2);  // p_c
  w.next();
  for (int i = 0; i < 4; ++i) {  // C
    w.refuses(kNaN, "expected finite numbers");
    w.refuses(1.1e150, "its covariance is none");
    w.refuses(i == 0 || i == 3 ? -1e-9 : -1.1e150, "its covariance is none");
    if (i == 0 || i == 3) w.refuses(0.0, "its covariance is none");
    w.takes(1e150);
    w.next();
  }
  w.next();
  for (int i = 0; i < 4; ++i) {  // B
    w.refuses(kNaN, "expected finite numbers");
    w.refuses(-2.1, "its covariance is none");
    w.takes(2.0);
    w.next();
  }
  w.boolean();                // moved
  w.real(1, kInf);            // condition
  w.integer(0, 3);            // decomposed
  w.integer(0, kMostInARow);  // flat
  w.integer(0, kMostInARow);  // all_failed
  w.integer(0, kMostTrials);  // refused
  ASSERT_EQ(w.word(), 1u) << "it holds a feasible trial";
  w.boolean();
  w.next();
  for (int i = 0; i < 2; ++i) {
    w.refuses(kNaN, "expected finite numbers");
    w.refuses(-2.01, "the trial it holds lies outside the bounds");
    w.takes(-2.0);
    w.next();
  }
  w.finite();  // held_cost
  w.noStop();
  for (int k = 0; k < 4; ++k) {
    w.refuses(3, "no trial ranks in class 3");
    if (k == 0) w.takes(2);
    w.next();
    w.finite();
  }
  w.integer(0, 3);  // history: count
  w.refuses(2, "it keeps 2 of 3 generations");
  w.next();
  for (int g = 0; g < 3; ++g) {
    for (int i = 0; i < 2; ++i) {
      w.refuses(3, "no trial ranks in class 3");
      w.refuses(UINT64_MAX, "a generation of its history has no cost");
      w.takes(2);
      w.next();
      w.finite();
    }
  }
  w.end();
}

TEST(Restore, OfCmaEsInAnotherBasisBelievesNoWord) {
  const CmaEsOptions o{.x0 = VectorXd::Ones(2), .lambda = 4};
  CmaEs cma(o);
  while (cma.state().lengths.size() == 0) {
    for (const Candidate& c : cma.ask()) {
      cma.tell(c.id, {.cost = c.x[0] * c.x[0] + 1e20 * c.x[1] * c.x[1]});
    }
    ASSERT_LT(cma.state().generation, 1000u);
  }
  Walk w(maker<CmaEs>(o), cma.save());
  w.next(3 + 2 + 1 + 4 * 3 + 2 * 5);
  w.boolean();
  w.finite(4);
  w.next();
  for (int i = 0; i < 2; ++i) {
    w.refuses(0.0, "expected numbers > 0, got 0");
    w.refuses(kInf, "expected finite numbers, got inf");
    w.next();
  }
  w.real(1, kInf);
}

TEST(Restore, BelievesNoGenerationThatIsOver) {
  // The last untold trial of each, told by hand.
  const CmaEsOptions o{.x0 = VectorXd::Ones(2), .lambda = 2};
  CmaEs cma(o);
  const Walk w(maker<CmaEs>(o), someWay(cma, 0));
  const size_t last = w.state().size() - 8 - 8 * 2 - 16;  // before the history and its two counts
  std::string over = withWord(w.state(), last, 0);
  EXPECT_NE(w.outcome(over).find("its generation is over, and was not learned from"),
            std::string::npos);

  const ContextualCmaOptions c{.tasks = threeTasks(), .x0 = VectorXd::Ones(2), .lambda = 4};
  ContextualCma contextual(c);
  for (int k = 0; k < 2; ++k) someWay(contextual, 0);
  const Walk v(maker<ContextualCma>(c), someWay(contextual, 0));
  over = v.state();
  over.insert(over.size() - 8, 3 * 8, '\0');
  over = withWord(over, over.size() - 8 - 4 * 8, 3);
  EXPECT_NE(v.outcome(over).find("its generation is over, and was not learned from"),
            std::string::npos);
  over = withWord(over, over.size() - 8 - 2 * 8, wordOf(kInf));
  EXPECT_NE(v.outcome(over).find("a trial has an infinite cost"), std::string::npos);
}

TEST(Restore, OfOnePlusOneBelievesNoWord) {
  const OnePlusOneOptions o{.x0 = VectorXd::Zero(2), .constraints = 2, .restarts = 4};
  OnePlusOne one(o);
  Walk w(maker<OnePlusOne>(o), someWay(one, 40, 2));
  w.refuses(3, "state of n = 3; expected n = 2");
  w.next();
  w.refuses(w.word() + 1, "under other options");
  w.next();
  w.integer(0, kMostTrials);
  w.integer(0, 4);  // descent
  w.finite(2);      // parent
  w.boolean();
  w.integer(0, 3);  // violations
  w.finite();       // cost
  w.positive();     // sigma
  w.real(0, 1);     // p_success
  w.finite(2);      // p_c
  w.next();
  for (int i = 0; i < 4; ++i) {  // L
    w.refuses(kNaN, "expected finite numbers");
    if (i == 0 || i == 3) w.refuses(0.0, "its covariance is none");
    w.next();
  }
  w.finite(6);  // fading
  const std::uint64_t ancestors = w.word();
  ASSERT_GT(ancestors, 2u);
  w.integer(0, 5);
  for (std::uint64_t i = 0; i < ancestors; ++i) w.finite();
  w.integer(0, kMostInARow);
  w.noStop();
  w.end();
}

TEST(Restore, OfRestartsBelievesNoWord) {
  const CmaEsOptions o{.x0 = VectorXd::Zero(2), .sigma = 0.25, .lambda = 4};
  const auto make = [&] {
    return std::make_unique<Restarts>(o, RestartOptions{.restarts = 3, .growth = 3});
  };
  Walk w(make, someWay(*make(), 3));
  w.refuses(w.word() + 1, "under other options");
  w.next();
  w.integer(1, kMostTrials);  // descents
  w.integer(0, 3);            // grown
  w.boolean();                // small
  w.refuses(2, "its first descent has another population");
  w.integer(2, 4);  // λ
  for (int i = 0; i < 4; ++i) w.integer(0, kMostTrials);
  w.real(kLeast, 0.25);  // σ
  w.text();
  w.end();
}

TEST(Restore, OfContextualBelievesNoWord) {
  const ContextualCmaOptions o{
      .tasks = threeTasks(), .x0 = VectorXd::Ones(2), .lambda = 8, .max_restarts = 5};
  ContextualCma contextual(o);
  Walk w(maker<ContextualCma>(o), someWay(contextual, 4));
  const ContextualCmaState& s = contextual.state();
  w.refuses(3, "state of n = 3, 3 tasks; expected n = 2, 3 tasks");
  w.next();
  w.refuses(4, "state of n = 2, 4 tasks; expected n = 2, 3 tasks");
  w.next();
  w.refuses(w.word() + 1, "under other options");
  w.next();
  w.integer(0, kMostGenerations);
  w.integer(0, kMostTrials);
  w.integer(0, 4);            // updates
  w.integer(0, kMostTrials);  // samples
  w.integer(0, 4);            // curves
  w.integer(0, 5);            // restarts
  w.integer(8, 8);            // λ
  w.integer(0, kMostInARow);
  w.positive();  // σ
  w.finite(4);   // A
  w.next();
  for (int i = 0; i < 4; ++i) {  // C
    w.refuses(kNaN, "expected finite numbers");
    if (i == 0 || i == 3) w.refuses(0.0, "its covariance is none");
    w.next();
  }
  w.finite(4);  // p_sigma
  w.finite(4);  // p_c
  ASSERT_GT(s.costs.size(), 0u);
  w.refuses(s.costs.size() - 1, "it has costs of another number of curves");
  w.next();
  for (size_t i = 0; i < s.costs.size(); ++i) {
    w.refuses(kNaN, "the cost of a curve is NaN");
    w.takes(kInf);
    w.next();
  }
  ASSERT_GT(s.elites.size(), 0u);
  w.refuses(std::uint64_t{1} << 40, "the state is cut short");
  w.next();
  for (size_t i = 0; i < s.elites.size(); ++i) {
    w.integer(0, 4);
    w.finite(2);
    w.refuses(2, "a trial has costs of 2 tasks");
    w.next();
    for (int task = 0; task < 3; ++task) {
      w.refuses(-kInf, "a trial has an infinite cost");
      w.takes(kNaN);
      w.next();
    }
  }
  w.noStop();
  ASSERT_EQ(w.word(), 1u) << "it has a best curve";
  w.boolean();
  w.finite(4);
  w.finite();
  w.finite(3);
  const std::uint64_t candidates = w.word();
  w.refuses(candidates - 1,
            fmt::format("it has {} candidates, expected {}", candidates - 1, candidates));
  w.next();
  w.refuses(2, "a trial has costs of 2 tasks");
  w.next();
  for (int task = 0; task < 3; ++task) {
    w.refuses(kInf, "a trial has an infinite cost");
    w.takes(kNaN);
    w.next();
  }
  w.next(candidates - 1);
  w.end();
}

TEST(Restore, OfCurveBelievesNoWord) {
  CurveCmaOptions o;
  o.tasks = threeTasks();
  o.x0 = VectorXd::Ones(2);
  o.lambda = 4;
  o.elites = 3;
  CurveCma curve(o);
  Walk w(maker<CurveCma>(o), someWay(curve, 5));
  const CurveCmaState& s = curve.state();
  ASSERT_FALSE(s.measuring);
  w.refuses(w.word() + 1, "under other options");
  w.next();
  w.integer(0, kMostGenerations);
  w.integer(0, kMostTrials);
  w.boolean();
  w.boolean();
  w.finite(4);
  w.finite(4);
  w.real(-kMax, kInf);  // cost
  w.refuses(4, "expected 3 numbers, got 4");
  w.next();
  for (int i = 0; i < 3; ++i) {
    w.refuses(kNaN, "a task of its curve has no cost");
    w.next();
  }
  w.positive();  // σ
  w.real(0, 1);  // p_success
  for (int task = 0; task < 3; ++task) {
    w.finite(2);
    w.next();
    for (int i = 0; i < 4; ++i) {
      w.refuses(kNaN, "expected finite numbers");
      if (i == 0 || i == 3) w.refuses(0.0, "a task's covariance is none");
      w.next();
    }
  }
  for (const auto& elites : s.elites) {
    ASSERT_GT(elites.size(), 0u);
    w.integer(0, 3);
    for (size_t i = 0; i < elites.size(); ++i) {
      w.finite();
      w.finite(2);
    }
  }
  w.integer(0, kMostInARow);
  w.noStop();
  for (int k = 0; k < 4; ++k) w.boolean();
  w.reals(12);
  w.end();
  // What is not told yet has no cost, which is not an infinite one.
  const size_t costs = w.at() - 12 * 8;
  EXPECT_NE(
      w.outcome(withWord(w.state(), w.at() - 8, wordOf(kInf))).find("a trial has an infinite cost"),
      std::string::npos);
  std::string over = w.state();
  for (int k = 1; k <= 3; ++k) over = withWord(over, costs - 8 - 8 * static_cast<size_t>(k), 1);
  EXPECT_NE(w.outcome(over).find("its generation is over, and was not learned from"),
            std::string::npos);
}

TEST(Restore, OfPhiCmaBelievesNoWord) {
  const CmaEsOptions o{.x0 = VectorXd::Ones(2), .lambda = 2};
  const auto make = [&] { return std::make_unique<PhiCma>(threeTasks(), 2, o); };
  const auto phi = make();
  Walk w(make, someWay(*phi, 2));
  w.next();
  for (int i = 0; i < 3; ++i) {
    w.refuses(0.25, "saved for other tasks");
    w.next();
  }
  const size_t inner = w.at() + 8;
  w.text();
  ASSERT_EQ(w.word(), 1u);
  w.boolean();
  w.refuses(1, "its curve is of another kind");
  w.boolean();
  w.integer(2, 2);
  w.integer(2, 2);
  w.finite(4);
  w.finite();
  w.finite(3);
  const size_t told = w.at();
  for (int k = 0; k < 6; ++k) {
    w.boolean();
    if (k == 0) w.refuses(kInf, "a trial has an infinite cost");
    if (k == 0) w.takes(kNaN);
    w.next();
  }
  w.end();
  std::string over = w.state();
  for (size_t k = 1; k < 6; ++k) over = withWord(over, told + 16 * k, 1);
  EXPECT_NE(w.outcome(over).find("its generation is over, and was not learned from"),
            std::string::npos);
  // Its curves are never told but all at once.
  CmaEs cma(phi->cma().options());
  cma.restore(phi->cma().save());
  cma.tell(cma.ask()[0].id, {.cost = 1});
  const std::string ahead = cma.save();
  over = w.state();
  over.replace(inner, ahead.size(), ahead);
  fingerprintAnew(over);
  EXPECT_NE(w.outcome(over).find("its curves are told before their points are"), std::string::npos);
}

TEST(Restore, OfIndividualCmaBelievesNoWord) {
  IndividualCmaOptions o;
  o.tasks = threeTasks();
  o.cma = {.x0 = VectorXd::Ones(2), .lower = VectorXd::Constant(2, -3), .lambda = 2};
  o.turn = 2;
  IndividualCma individual(o);
  Walk w(maker<IndividualCma>(o), someWay(individual, 7));  // it is the first's turn once more
  w.refuses(w.word() + 1, "under other options");
  w.next();
  w.integer(0, kMostGenerations);
  w.integer(0, kMostTrials);
  w.integer(0, 2);
  w.integer(0, 2);
  size_t first_inner = 0;
  for (int task = 0; task < 3; ++task) {
    ASSERT_EQ(w.word(), 1u);
    if (task == 0) w.refuses(0, "a task has no search");
    w.boolean();
    w.finite(2);
    if (task == 0) first_inner = w.at() + 8;
    w.text();
    w.real(-kMax, kInf);
    w.integer(2, 2);
    w.integer(1, 1);
    w.next();
    for (int i = 0; i < 2; ++i) {
      w.refuses(kNaN, "expected finite numbers");
      w.refuses(-3.01, "a task's best lies outside the bounds");
      w.next();
    }
    w.noStop();
  }
  w.noStop();
  ASSERT_EQ(w.word(), 1u);
  w.boolean();
  w.refuses(0, "its curve is of another kind");
  w.boolean();
  w.integer(2, 2);
  w.integer(3, 3);
  w.finite(6);
  w.finite();
  w.finite(3);
  w.refuses(3, "of another number of candidates");
  w.next();
  for (int k = 0; k < 2; ++k) {
    if (k == 1) w.refuses(1, "its generation is over, and was not learned from");
    w.boolean();
    if (k == 0) w.refuses(kInf, "a trial has an infinite cost");
    w.next();
  }
  w.end();
  // A search is never told but when its generation is over.
  std::string ahead = w.state();
  const std::uint64_t size = [&] {
    std::uint64_t value = 0;
    std::memcpy(&value, ahead.data() + first_inner - 8, 8);
    return value;
  }();
  const size_t history = 16 + size_t{3} * 32;  // two counts, and its three generations
  ahead = withWord(ahead, first_inner + size - 8 - history - 32, 0);
  EXPECT_NE(w.outcome(ahead).find("a search was told more than its task"), std::string::npos)
      << w.outcome(ahead);
}

TEST(Restore, OfIndividualCmaKnowsTasksWithoutACost) {
  IndividualCmaOptions o;
  o.tasks = threeTasks();
  o.cma = {.x0 = VectorXd::Ones(2), .lambda = 2};
  IndividualCma individual(o);
  for (const Candidate& c : individual.ask()) individual.tell(c.id, {.failed = true});
  Walk w(maker<IndividualCma>(o), individual.save());
  w.next(3 + 1);
  w.integer(0, 0);  // no turns
  for (int task = 0; task < 3; ++task) {
    w.refuses(0, "a task has no search");
    w.boolean();
    w.finite(2);
    w.text();
    w.real(-kMax, kInf);
    w.integer(0, 0);
    w.integer(1, 1);
    w.next();  // no numbers
    w.noStop();
  }
  w.noStop();
  w.noStop();  // nor a best family
}

TEST(Restore, OfCmaCBelievesNoWord) {
  const CmaCOptions o{
      .cma = {.x0 = VectorXd::Zero(2), .lambda = 4}, .constraints = 2, .restarts = 6};
  CmaC c(o);
  Walk w(maker<CmaC>(o), someWay(c, 3, 2));
  w.refuses(3, "state of n = 3, lambda = 4; expected n = 2, lambda = 4");
  w.next();
  w.refuses(5, "state of n = 2, lambda = 5; expected n = 2, lambda = 4");
  w.next();
  w.refuses(w.word() + 1, "under other options");
  w.next();
  w.integer(0, kMostGenerations);
  w.integer(1, 7);  // descents
  w.integer(0, 0);  // descent
  w.integer(0, kMostTrials);
  for (int i = 0; i < 4; ++i) w.boolean();
  w.integer(0, 1);  // toured
  w.integer(0, 0);  // best_descent
  w.finite();       // best_cost
  w.text();
  for (int j = 0; j < 2; ++j) {
    w.boolean();
    w.integer(0, kMostTrials);
    const std::uint64_t judged = c.classifiers()[j].judged;
    ASSERT_GT(judged, 0u);
    w.integer(0, judged);
    w.real(0, 1);
  }
  w.refuses(3, "expected 2 numbers, got 3");
  w.next();
  for (int j = 0; j < 2; ++j) {
    w.refuses(-0.5, "a kernel has γ = -0.5");
    w.refuses(kInf, "expected finite numbers, got inf");
    w.next();
  }
  const std::uint64_t known = w.word();
  ASSERT_EQ(known, 12u);
  w.integer(0, 4000);
  const auto label = [&](char letter) {
    std::string state = w.state();
    state[w.at() + 8] = letter;
    fingerprintAnew(state);
    return w.outcome(state);
  };
  const auto trial = [&] {
    w.finite(2);
    EXPECT_NE(label('x').find("a trial has a label that is none"), std::string::npos);
    for (const char letter : {'+', '-', '0'}) EXPECT_EQ(label(letter), "") << letter;
    w.text();
  };
  for (std::uint64_t k = 0; k < known; ++k) trial();
  w.boolean();
  trial();
  for (int k = 1; k < 4; ++k) w.boolean();
  const size_t inner = w.at() + 8;
  w.text();
  w.end();

  // It and its search must agree about who was told.
  CmaEs ahead(c.cma().options());
  ahead.restore(c.cma().save());
  ahead.tell(ahead.ask()[0].id, {.cost = 1, .violated = {false, false}});
  std::string state = w.state();
  state.replace(inner, ahead.save().size(), ahead.save());
  fingerprintAnew(state);
  EXPECT_NE(w.outcome(state).find("disagrees about who was told"), std::string::npos);
}

/// A state saved under options is refused under each of the others, and taken under its own.
template <class Options>
void expectOptionsMatter(const Options& options,
                         const std::function<std::unique_ptr<Optimizer>(const Options&)>& make,
                         const std::vector<std::function<void(Options&)>>& changes) {
  const std::string state = make(options)->save();
  EXPECT_NO_THROW(make(options)->restore(state));
  for (size_t i = 0; i < changes.size(); ++i) {
    Options other = options;
    changes[i](other);
    EXPECT_THROW(make(other)->restore(state), InputError) << "change " << i;
  }
}

void changeX0(VectorXd& x0) {
  x0[1] = 0.5;
}

TEST(Restore, OfCmaEsNeedsEqualOptions) {
  using Change = std::function<void(CmaEsOptions&)>;
  const std::vector<Change> changes = {
      [](auto& o) { changeX0(o.x0); },
      [](auto& o) { o.scale = VectorXd::Constant(2, 2); },
      [](auto& o) { o.lower = VectorXd::Constant(2, -3); },
      [](auto& o) { o.upper = VectorXd::Constant(2, 3); },
      [](auto& o) { o.sigma = 0.2; },
      [](auto& o) { o.lambda = 7; },
      [](auto& o) { o.active = false; },
      [](auto& o) { o.seed = 2; },
      [](auto& o) { o.feasible_first = false; },
      [](auto& o) { o.hold_feasible = true; },
      [](auto& o) { o.try_start = true; },
      [](auto& o) { o.likeliest = false; },
      [](auto& o) { o.acceptance = [](int, const VectorXd&) { return 1.0; }; },
      [](auto& o) { o.termination.tolx = 1e-3; },
      [](auto& o) { o.termination.tolfun = 1e-3; },
      [](auto& o) { o.termination.tolfunhist = 1e-3; },
      [](auto& o) { o.termination.tolxup = 9; },
      [](auto& o) { o.termination.tolupsigma = 9; },
      [](auto& o) { o.termination.conditioncov = 9; },
      [](auto& o) { o.termination.tolflatfitness = 9; },
      [](auto& o) { o.termination.equalfunvals = false; },
      [](auto& o) { o.termination.noeffectaxis = false; },
      [](auto& o) { o.termination.noeffectcoord = false; },
      [](auto& o) { o.termination.tolstagnation = 9; },
      [](auto& o) { o.termination.maxiter = 9; },
      [](auto& o) { o.termination.tolallfailed = 9; }};
  const auto make = [](const CmaEsOptions& o) { return std::make_unique<CmaEs>(o); };
  expectOptionsMatter<CmaEsOptions>({.x0 = VectorXd::Zero(2)}, make, changes);
  CmaEsOptions choosy{.x0 = VectorXd::Zero(2),
                      .acceptance = [](int, const VectorXd&) { return 1.0; }};
  expectOptionsMatter<CmaEsOptions>(choosy, make, {[](auto& o) { o.max_draws = 9; }});
  // Without acceptance nothing is drawn twice.
  CmaEs patient({.x0 = VectorXd::Zero(2), .max_draws = 9});
  EXPECT_NO_THROW(patient.restore(CmaEs({.x0 = VectorXd::Zero(2)}).save()));
}

TEST(Restore, OfOnePlusOneNeedsEqualOptions) {
  using Change = std::function<void(OnePlusOneOptions&)>;
  const std::vector<Change> changes = {[](auto& o) { changeX0(o.x0); },
                                       [](auto& o) { o.scale = VectorXd::Constant(2, 2); },
                                       [](auto& o) { o.lower = VectorXd::Constant(2, -3); },
                                       [](auto& o) { o.upper = VectorXd::Constant(2, 3); },
                                       [](auto& o) { o.sigma = 0.2; },
                                       [](auto& o) { o.tolx = 1e-3; },
                                       [](auto& o) { o.tolxup = 9; },
                                       [](auto& o) { o.constraints = 1; },
                                       [](auto& o) { o.active = false; },
                                       [](auto& o) { o.active_constraints = false; },
                                       [](auto& o) { o.feasible_first = false; },
                                       [](auto& o) { o.tolallfailed = 9; },
                                       [](auto& o) { o.restarts = 9; },
                                       [](auto& o) { o.seed = 2; }};
  expectOptionsMatter<OnePlusOneOptions>(
      {.x0 = VectorXd::Zero(2)}, [](const auto& o) { return std::make_unique<OnePlusOne>(o); },
      changes);
}

TEST(Restore, OfRestartsNeedsEqualOptions) {
  using Both = std::pair<CmaEsOptions, RestartOptions>;
  using Change = std::function<void(Both&)>;
  const std::vector<Change> changes = {[](auto& o) { changeX0(o.first.x0); },
                                       [](auto& o) { o.first.scale = VectorXd::Constant(2, 2); },
                                       [](auto& o) { o.first.lower = VectorXd::Constant(2, -3); },
                                       [](auto& o) { o.first.upper = VectorXd::Constant(2, 3); },
                                       [](auto& o) { o.first.sigma = 0.2; },
                                       [](auto& o) { o.first.lambda = 7; },
                                       [](auto& o) { o.first.seed = 2; },
                                       [](auto& o) { o.first.active = false; },
                                       [](auto& o) { o.second.restarts = 3; },
                                       [](auto& o) { o.second.growth = 3; },
                                       [](auto& o) { o.second.bipop = true; }};
  expectOptionsMatter<Both>(
      {{.x0 = VectorXd::Zero(2)}, {}},
      [](const auto& o) { return std::make_unique<Restarts>(o.first, o.second); }, changes);
}

TEST(Restore, OfContextualNeedsEqualOptions) {
  using Change = std::function<void(ContextualCmaOptions&)>;
  const std::vector<Change> changes = {[](auto& o) { changeX0(o.x0); },
                                       [](auto& o) { o.tasks[1] = 0.4; },
                                       [](auto& o) { o.scale = VectorXd::Constant(2, 2); },
                                       [](auto& o) { o.lower = VectorXd::Constant(2, -3); },
                                       [](auto& o) { o.upper = VectorXd::Constant(2, 3); },
                                       [](auto& o) { o.sigma = 0.2; },
                                       [](auto& o) { o.curve_share = 0.3; },
                                       [](auto& o) { o.tolx = 1e-3; },
                                       [](auto& o) { o.tolstagnation = 1e-2; },
                                       [](auto& o) { o.lambda_factor = 3; },
                                       [](auto& o) { o.control_points = 3; },
                                       [](auto& o) { o.lambda = 7; },
                                       [](auto& o) { o.max_restarts = 3; },
                                       [](auto& o) { o.stagnation_curves = 9; },
                                       [](auto& o) { o.elite_generations = 3; },
                                       [](auto& o) { o.seed = 2; }};
  expectOptionsMatter<ContextualCmaOptions>(
      {.tasks = threeTasks(), .x0 = VectorXd::Zero(2)},
      [](const auto& o) { return std::make_unique<ContextualCma>(o); }, changes);
}

TEST(Restore, OfCurveNeedsEqualOptions) {
  using Change = std::function<void(CurveCmaOptions&)>;
  const std::vector<Change> changes = {[](auto& o) { changeX0(o.x0); },
                                       [](auto& o) { o.tasks[1] = 0.4; },
                                       [](auto& o) { o.scale = VectorXd::Constant(2, 2); },
                                       [](auto& o) { o.lower = VectorXd::Constant(2, -3); },
                                       [](auto& o) { o.upper = VectorXd::Constant(2, 3); },
                                       [](auto& o) { o.sigma = 0.2; },
                                       [](auto& o) { o.alpha = 3; },
                                       [](auto& o) { o.failure_exponent = 0.5; },
                                       [](auto& o) { o.c_cov_offset = 2; },
                                       [](auto& o) { o.tolx = 1e-3; },
                                       [](auto& o) { o.tolxup = 9; },
                                       [](auto& o) { o.control_points = 9; },
                                       [](auto& o) { o.lambda = 7; },
                                       [](auto& o) { o.elites = 7; },
                                       [](auto& o) { o.groups = 7; },
                                       [](auto& o) { o.step_size = StepSize::kVariance; },
                                       [](auto& o) { o.fit_error = FitError::kStandardErrors; },
                                       [](auto& o) { o.normalised_steps = false; },
                                       [](auto& o) { o.fresh_success_rate = false; },
                                       [](auto& o) { o.best_group_first = true; },
                                       [](auto& o) { o.pool_first_curve = true; },
                                       [](auto& o) { o.tolallfailed = 7; },
                                       [](auto& o) { o.seed = 2; }};
  CurveCmaOptions options;
  options.tasks = threeTasks();
  options.x0 = VectorXd::Zero(2);
  options.control_points = 8;  // of which three are used
  expectOptionsMatter<CurveCmaOptions>(
      options, [](const auto& o) { return std::make_unique<CurveCma>(o); }, changes);
}

TEST(Restore, OfIndividualCmaNeedsEqualOptions) {
  using Change = std::function<void(IndividualCmaOptions&)>;
  const std::vector<Change> changes = {
      [](auto& o) { o.tasks *= 2; }, [](auto& o) { o.target = 3; }, [](auto& o) { o.turn = 7; },
      [](auto& o) { o.cma.sigma = 0.2; }, [](auto& o) { o.cma.seed = 2; }};
  IndividualCmaOptions options;
  options.tasks = threeTasks();
  options.cma.x0 = VectorXd::Zero(2);
  options.turn = 3;
  expectOptionsMatter<IndividualCmaOptions>(
      options, [](const auto& o) { return std::make_unique<IndividualCma>(o); }, changes);
}

TEST(Restore, OfCmaCNeedsEqualOptions) {
  using Change = std::function<void(CmaCOptions&)>;
  const std::vector<Change> changes = {
      [](auto& o) { o.cma.sigma = 0.2; },
      [](auto& o) { o.cma.max_draws = 9; },
      [](auto& o) { o.constraints = 2; },
      [](auto& o) { o.alpha = 3; },
      [](auto& o) { o.wide_width = 3; },
      [](auto& o) { o.wide_C = 3; },
      [](auto& o) { o.near_width = 3; },
      [](auto& o) { o.near_C = 3; },
      [](auto& o) { o.least_agreement = 0.5; },
      [](auto& o) { o.collapsed = 0.5; },
      [](auto& o) { o.least_labels = 2; },
      [](auto& o) { o.balanced = false; },
      [](auto& o) { o.width_at_first_use = true; },
      [](auto& o) { o.neighbours = 9; },
      [](auto& o) { o.most_points = 9; },
      [](auto& o) { o.restarts = 9; },
      [](auto& o) { o.tours = 9; },
      [](auto& o) { o.follow = false; },
      [](auto& o) { o.experience[0].x[1] = 0.5; },
      [](auto& o) { o.experience[0].evaluation.violated = {true}; },
      [](auto& o) { o.experience.push_back(o.experience[0]); }};
  const CmaCOptions options{.cma = {.x0 = VectorXd::Zero(2)},
                            .constraints = 1,
                            .experience = {{VectorXd::Ones(2), {.cost = 1, .violated = {false}}}}};
  expectOptionsMatter<CmaCOptions>(
      options, [](const auto& o) { return std::make_unique<CmaC>(o); }, changes);
  const std::vector<Change> model_changes = {
      [](auto& o) { o.choices = 1; },       [](auto& o) { o.choices = 3; },
      [](auto& o) { o.model_width = 3; },   [](auto& o) { o.model_noise = 0.5; },
      [](auto& o) { o.model_caution = 0; }, [](auto& o) { o.model_points = 9; }};
  expectOptionsMatter<CmaCOptions>(
      modelCmaC(options), [](const auto& o) { return std::make_unique<CmaC>(o); }, model_changes);
}

/// The costs that a model learns from are in the state, and must be finite.
TEST(Restore, OfCmaCWithAModelBelievesNoCost) {
  const CmaCOptions o = modelCmaC({.cma = {.x0 = VectorXd::Zero(2), .lambda = 4}});
  CmaC c(o);
  for (const Candidate& candidate : c.ask()) c.tell(candidate.id, {.cost = 1});
  Walk w(maker<CmaC>(o), c.save());
  w.next(3 + 8);  // n, λ, options; generation to exploring
  w.next(3);      // toured, best_descent, best_cost
  w.text();       // best
  w.next();       // γ: none
  ASSERT_EQ(w.word(), 4u);
  w.integer(0, 4000);
  for (int k = 0; k < 4; ++k) {
    w.finite(2);
    w.text();  // labels: none
    EXPECT_EQ(w.word(), 1u);
    w.boolean();
    w.finite();
  }
}

}  // namespace
}  // namespace traceur::optim
