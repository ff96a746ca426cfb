// CMA-ES that begins anew when it has nothing more to gain: IPOP and BIPOP.
#pragma once

#include <memory>

#include "traceur/optim/cma_es.h"

namespace traceur::optim {

struct RestartOptions {
  int restarts = 9;   ///< of growing populations at most; pycma's default when restarts are wished
  double growth = 2;  ///< λ of one descent to the next [Auger2005]; 1: only begin anew
  /// Between them, small descents with small steps, for as many trials as the large ones had
  /// [Hansen2009].
  bool bipop = false;
};

/// IPOP-CMA-ES [Auger2005]: descent k = 0, 1, … has λ_k = λ_0 growth^k, and the first step size.
///
/// BIPOP-CMA-ES [Hansen2009] begins, whenever the small descents have used fewer trials than the
/// large ones, a small one,
///
///     λ_s = ⌊λ_0 (λ_l / (2 λ_0))^(U²)⌋,   σ_s = σ_0 10^(-2U'),   U, U' ~ U(0, 1)
///
/// with λ_l of the latest large descent, which ends after half of that one's trials at most, but
/// for the last one, after which no large one may follow: it ends by itself.
///
/// Every descent but the first starts uniformly between two bounds, or at x0 + σ₀ scale N(0, 1)
/// where a variable has not both. A descent whose trials all failed is not followed by another.
class Restarts : public Optimizer {
 public:
  /// @throws InputError as CmaEs, for negative restarts, or growth < 1
  explicit Restarts(CmaEsOptions options, RestartOptions restarts = {});

  std::vector<Candidate> ask() override;
  void tell(std::uint64_t id, const Evaluation& evaluation) override;
  /// What the last descent said, once there is none left.
  std::optional<Stop> stopped() const override { return cma_->stopped(); }
  std::string save() const override;
  void restore(std::string_view state) override;

  const CmaEs& cma() const { return *cma_; }                      ///< the descent under way
  int descents() const { return static_cast<int>(s_.descents); }  ///< begun

 private:
  struct State {
    std::uint64_t descents = 1;
    std::uint64_t grown = 0;  // large descents after the first
    bool small = false;       // the descent under way
    std::uint64_t lambda = 0;
    double sigma = 0;
    std::uint64_t first_id = 0;      // of the descent under way
    std::uint64_t used[2] = {0, 0};  // trials of ended large and small descents
    std::uint64_t latest_large = 0;  // trials of the latest ended large descent
  };

  std::unique_ptr<CmaEs> make(const State& state) const;
  double grown(std::uint64_t k) const;
  void endGeneration();
  std::uint64_t fingerprint() const;
  template <class IO, class Fields>
  void fields(IO& io, Fields& s, std::string& inner) const;

  CmaEsOptions options_;
  RestartOptions restarts_;
  State s_;
  std::unique_ptr<CmaEs> cma_;
};

}  // namespace traceur::optim
