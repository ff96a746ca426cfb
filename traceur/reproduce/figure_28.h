// Figure 28 of the dissertation: what CMA-C has learned to be feasible, against the truth.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace traceur::reproduce {

/// Toy3's L after one run, on a grid over [3, 5]² as printed [Ha2015, Fig. 28; its caption says the
/// second toy problem, its L is the third's].
struct LearnedRegion {
  static constexpr double kLow = 3;
  static constexpr double kHigh = 5;
  static constexpr int kCells = 100;  ///< along each side; cell (i, j) is about
                                      ///< kLow + (i + 1/2) (kHigh - kLow)/kCells in x, j in y

  std::vector<bool> learned;   ///< (kCells²), j·kCells + i: a draw there would pass at even odds
  std::vector<bool> truth;     ///< (kCells²)
  std::vector<double> x, y;    ///< of every trial of the run
  std::vector<bool> feasible;  ///< of every trial
  double precision = 0;        ///< share of the learned region that is feasible
  double recall = 0;           ///< share of the feasible region that is learned
};

/// One run until all of eight trials lie within 0.5 of the optimum, as in Table 7.
/// @param algorithm  "CMA-C 2015" or "CMA-C" of toyAlgorithms()
/// @throws InputError for another
LearnedRegion learnRegion(std::string_view algorithm, std::uint64_t seed);

}  // namespace traceur::reproduce
