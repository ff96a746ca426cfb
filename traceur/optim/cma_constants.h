// The numbers that decide how fast CMA-ES learns: functions of n and λ alone.
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace traceur::optim {

/// Largest standard deviation as a fraction of the distance between two bounds, as pycma's
/// maxstd_boundrange. A uniform distribution over the box has 0.29.
inline constexpr double kWidestStep = 1.0 / 3;
/// Of a failed trial's negative weight [ours]. 1 learns faster along a cliff beyond which all
/// fails, 0 when failures are blind chance. Median trials of CMA-ES, 51 seeds, with 1, ½, 0: the
/// 10-D ellipsoid under 50 % of random failures 19140, 14610, 13500; a slope that ends in a cliff,
/// 5-D, 1096, 1184, 1448.
inline constexpr double kWeightOfFailure = 0.5;
/// More samples in a generation are a typing error rather than a population.
inline constexpr int kMaxLambda = 1'000'000;
/// Random stream of fresh starts, which no trial's number reaches.
inline constexpr std::uint64_t kDescentStream = 0x64657363656e74;  // "descent"

/// The strategy constants of CMA-ES [Hansen2016, Tab. 1, 2023 revision], with
///
///     w′_i = ln((λ+1)/2) - ln i,   i = 1 … λ
///     μ_eff = (Σ w⁺)² / Σ w⁺²      (μ_eff⁻ likewise from the negative ones)
///     c_1   = min(1, λ/6) · 2 / ((n+1.3)² + μ_eff)
///     c_μ   = min(1 - c_1, 2 (1/4 + μ_eff + 1/μ_eff - 2) / ((n+2)² + μ_eff))
///     c_c   = (4 + μ_eff/n) / (n + 4 + 2 μ_eff/n)
///     c_σ   = (μ_eff + 2) / (n + μ_eff + 3)
///     d_σ   = 1 + 2 max(0, √((μ_eff-1)/(n+1)) - 1) + c_σ
///
/// The factor min(1, λ/6) of c_1, and the 3 of c_σ where the tutorial has 5, are pycma's; the 3
/// saves 1 to 3 % of the trials on most of bench/optim_parity [ours; 201 seeds].
struct CmaConstants {
  int lambda = 0;           ///< λ, trials per generation
  int mu = 0;               ///< μ = ⌊λ/2⌋, those with a positive weight
  Eigen::VectorXd weights;  ///< (λ) falling; the first μ sum to 1, the rest are ≤ 0
  double mu_eff = 0;        ///< of the positive weights
  double mu_eff_minus = 0;  ///< of the negative weights before scaling
  double c_sigma = 0;       ///< learning rate of the path p_σ
  double d_sigma = 0;       ///< damping of the step size
  double c_c = 0;           ///< learning rate of the path p_c
  double c_1 = 0;           ///< learning rate of the rank-one update
  double c_mu = 0;          ///< learning rate of the rank-μ update
  double chi_n = 0;         ///< E‖N(0, I)‖ ≈ √n (1 - 1/(4n) + 1/(21n²))
  double eigen_gap = 0;     ///< max(1, 1/(10 n (c_1 + c_μ))), generations between decompositions
};

/// @param n       ≥ 1
/// @param lambda  ≥ 2; 0: 4 + ⌊3 ln n⌋
/// @param active  false: the negative weights are 0
CmaConstants cmaConstants(int n, int lambda = 0, bool active = true);

}  // namespace traceur::optim
