// CMA-C: CMA-ES that learns from its failures where not to try.
#pragma once

#include <memory>
#include <vector>

#include "traceur/optim/cma_es.h"
#include "traceur/optim/cost_model.h"
#include "traceur/optim/svm_classifier.h"

namespace traceur::optim {

/// The defaults are ours; dissertationCmaC() gives the printed ones. What is not said otherwise was
/// chosen on 100 seeds from 10000 of four rows of Tables 7 to 9 [Ha2015] and on 5 seeds of the
/// constrained problems of traceur/reproduce, and judged on others.
struct CmaCOptions {
  /// The distribution. acceptance, and with follow also hold_feasible, try_start are set by CmaC.
  CmaEsOptions cma = {};
  /// How many constraints a trial reports on. 0: this is CMA-ES, to the bit.
  int constraints = 0;
  /// Trials run earlier under the same constraints and variables: their classifiers are there at
  /// once. A trial that reports on fewer constraints leaves the others unlabelled; one that
  /// reports on none says that all hold.
  std::vector<Trial> experience = {};

  /// α of the probability 1/(1 + exp(-α d)) with which one classifier lets a draw pass [Ha2015,
  /// §6.3].
  double alpha = 4;
  /// A classifier is there once it has so many trials of each label [ours; not printed].
  int least_labels = 1;
  /// The rarer label counts for more, so that both weigh the same. Without, one run in five of
  /// ratio 800 loses the feasible region to a classifier that refuses everything.
  bool balanced = true;

  /// Kernel while no feasible trial is known: its standard deviation in units of σ₀, times √(n/2),
  /// for distances grow so. k = 0.1 is printed [Ha2015, §6.3], for n = 2; so is γ = 1/2 (kσ)², read
  /// as 1/(2 (kσ)²), for the kernel has to "cover only a portion" of the distribution.
  double wide_width = 0.1;
  /// Printed: in units of σ when the classifier was first there, and frozen then. On ratio 800,
  /// where that is latest, no difference was seen.
  bool width_at_first_use = false;
  double wide_C = 1;  ///< its price of an error; LIBSVM's default

  /// Once a feasible trial is known, classify in the metric of the distribution, anew for every
  /// generation and from the trials nearest to it: the classifiers then follow a distribution that
  /// shrinks onto a boundary. Also tries x0 first and holds the best feasible trial (CmaEs).
  bool follow = true;
  double near_width = 2;  ///< kernel's standard deviation: so many of the distribution's, times √n
  double near_C = 100;    ///< nearly hard: seen closely enough, a boundary is smooth
  int neighbours = 0;     ///< trials of each label, the nearest to the mean; 0: 20 + 2n
  /// Trials of each label a wide kernel learns from, the nearest to the mean. 0: all.
  int most_points = 500;

  /// A classifier is not asked while its running agreement with trials is below this: a wrong one
  /// cannot lock the feasible region out. 0: always asked.
  double least_agreement = 0.3;

  /// Fresh starts at most, x0 + σ₀ N(0, I) inside the bounds, that keep all that classifiers know:
  /// made when the search shrank below `collapsed` without a feasible trial, or stopped (but for
  /// "tolallfailed"). Only once a constraint has been violated.
  int restarts = 30;
  double collapsed = 0.02;  ///< σ·√(largest eigenvalue of C)/σ₀
  /// Where the first trial was infeasible, nothing says that the first region found is the best:
  /// once collapsed, so many other starts are made, each until it has collapsed, and the search
  /// goes on with the best of all. Needs feasible_first, as does starting anew after a collapse.
  int tours = 3;

  /// Of so many draws that pass, the one that a model of the cost (CostModel) thinks best is tried:
  /// pre-selection, one of the ways in which Gaussian processes help CMA-ES [Bajer2019]; the
  /// details are ours. 1: no model, and the bits are those there were before there was one. The
  /// numbers of modelCmaC() were chosen on 30 seeds from 5000 of a jump's leaning and judged on
  /// others.
  int choices = 1;
  double model_width = 1;  ///< kernel's standard deviation: so many of the distribution's, times √n
  double model_noise = 0.1;  ///< CostModelOptions::noise
  double model_caution = 1;  ///< κ ≥ 0: a draw promises mean - κ deviation; more explores more
  int model_points = 100;    ///< trials it learns from, the nearest to the mean
};

/// CMA-C as printed [Ha2015, §6.3]: frozen kernels of all trials, nothing balanced, no restart, all
/// trials ranked by cost, after max_draws the last draw taken. Open in print and read so: a
/// classifier after one label of each kind, C = 1, 100 draws.
CmaCOptions dissertationCmaC(CmaEsOptions cma, int constraints);

/// The given options with a model of the cost, which tries the best of 10 draws.
CmaCOptions modelCmaC(CmaCOptions options);

/// What a classifier has been worth: its predictions of trials against what they said.
struct ClassifierReport {
  bool active = false;       ///< there, for the current generation
  std::uint64_t judged = 0;  ///< trials it predicted
  std::uint64_t agreed = 0;  ///< of these, rightly
  double agreement = 0.7;    ///< running share of right ones, over about 20 trials
};

/// CMA-ES with one support vector machine per constraint [Ha2015, §6.3]. A draw x passes with
/// probability
///
///     Π_j 1/(1 + exp(-α d_j(x)))
///
/// with d_j > 0 where classifier j expects constraint j to hold; one that does not pass costs no
/// trial, and another is drawn. Of max_draws refused ones the likeliest is tried, so that labels
/// never stop coming. Failed trials teach no label.
///
/// With options.choices > 1 a Gaussian process learns what trials cost relative to each other, from
/// those that ranking compares by cost, anew for every generation, near the search and in its
/// metric, as the classifiers do. Where failures are soon avoided, as in a motion that no
/// classifier lets fail more than one time in ten, it is the cost that the trials are spent on.
///
/// Life: as Optimizer. One generation is λ trials. stopped() is what CMA-ES says once there are no
/// restarts left.
class CmaC : public Optimizer {
 public:
  /// @throws InputError as CmaEs, for a negative number of constraints, an option out of range, or
  ///         experience of another dimension or with more constraints
  explicit CmaC(CmaCOptions options);
  CmaC(const CmaC&) = delete;
  CmaC& operator=(const CmaC&) = delete;

  std::vector<Candidate> ask() override;
  void tell(std::uint64_t id, const Evaluation& evaluation) override;
  std::optional<Stop> stopped() const override;
  std::string save() const override;
  void restore(std::string_view state) override;

  const CmaCOptions& options() const { return options_; }
  /// The search under way.
  const CmaEs& cma() const { return *cma_; }
  int descents() const { return static_cast<int>(s_.descents); }  ///< begun: restarts + 1
  /// Draws the classifiers refused, in the told generations: trials not simulated.
  std::uint64_t refused() const { return s_.refused; }
  /// (constraints) as of the last told generation.
  const std::vector<ClassifierReport>& classifiers() const { return s_.reports; }
  /// The probability that a draw at x, (n), passes now.
  double acceptance(const VectorXd& x) const;

 private:
  enum Label : signed char { kUnknown = 0, kHolds = 1, kViolated = -1 };
  struct Labelled {
    VectorXd x;
    std::vector<Label> labels;        // (constraints)
    std::optional<double> cost = {};  // where there is a model; none if it may not learn it
  };
  struct State {
    std::uint64_t generation = 0;  // of all descents
    std::uint64_t descents = 1;    // begun
    std::uint64_t descent = 0;     // under way: its number, from 0
    std::uint64_t refused = 0;
    bool violated = false;       // a constraint, ever
    bool seen_feasible = false;  // in this descent
    bool told_feasible = false;  // in this generation
    bool exploring = false;      // on a tour
    std::uint64_t toured = 0;    // descents of it that ended
    std::uint64_t best_descent = 0;
    double best_cost = 0;
    std::string best;  // the state of the best descent of the tour; empty: none
    std::vector<ClassifierReport> reports;
    std::vector<double> gamma;  // (constraints) frozen kernels; 0: not yet
    std::vector<Labelled> known;
  };

  int dimension() const { return static_cast<int>(options_.cma.x0.size()); }
  std::unique_ptr<CmaEs> makeDescent(std::uint64_t descent) const;
  std::vector<Label> labelsOf(const Evaluation& evaluation) const;
  void prepare();
  void setMetric();
  VectorXd inMetric(const VectorXd& x) const;
  void train(int constraint, const MatrixXd& Z);
  void trainModel(const MatrixXd& Z);
  double promise(const VectorXd& x) const;
  void endGeneration();
  void judge(const Labelled& trial);
  void endDescent();
  void beginDescent();
  void addKnown(Labelled trial);
  std::uint64_t fingerprint() const;
  template <class IO, class Trial>
  void trialField(IO& io, Trial& trial) const;
  template <class IO, class Fields, class Trials>
  void fields(IO& io, Fields& s, Trials& told, std::string& inner) const;

  CmaCOptions options_;
  BoundFold bounds_;
  State s_;
  std::unique_ptr<CmaEs> cma_;
  std::vector<std::optional<Labelled>> told_;  // (λ) of the current generation

  // Scratch: all of it follows from the state.
  bool prepared_ = false;
  bool local_ = false;
  std::vector<VectorXd> x_;  // (λ) of the current generation, those told before restore() empty
  std::vector<std::optional<SvmClassifier>> svm_;
  std::optional<CostModel> model_;
  VectorXd center_;  // (n) of the metric
  MatrixXd metric_;  // (n x n)
};

}  // namespace traceur::optim
